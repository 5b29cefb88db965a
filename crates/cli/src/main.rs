//! The program `tyndall`: parses, calls the library, and shows. No algorithm lives here.

mod args;
mod failure;
mod info;
mod input;
mod lists;
mod output;
mod progress;
mod render;
mod stats;

use args::{Args, Command};
use clap::{CommandFactory, Parser};
use failure::Failure;
use std::io::{ErrorKind, Write};
use std::process::ExitCode;
use std::time::Instant;

fn main() -> ExitCode {
    let started = Instant::now();
    let args = Args::parse();
    let done = match args.command {
        Command::Render(options) => render::run(&options, started),
        Command::Info(options) => info::run(&options),
        Command::Presets => lists::presets(),
        Command::Schema => lists::schema(),
        Command::Completions { shell } => {
            let mut script = Vec::new();
            clap_complete::generate(shell, &mut Args::command(), "tyndall", &mut script);
            say(&String::from_utf8_lossy(&script))
        }
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            if let Some(message) = failure.message() {
                // With stderr closed there is nowhere left to say it.
                drop(writeln!(std::io::stderr(), "tyndall: {message}"));
            }
            failure.exit_code()
        }
    }
}

/// Writes to stdout; a closed pipe is a failure with a message, not a panic.
fn say(text: &str) -> Result<(), Failure> {
    let mut out = std::io::stdout().lock();
    out.write_all(text.as_bytes()).and_then(|()| out.flush()).map_err(|e| stdout_failure(&e))
}

/// Why stdout took no more.
fn stdout_failure(error: &std::io::Error) -> Failure {
    let mend = match error.kind() {
        ErrorKind::BrokenPipe => "what reads it must stay open to the end",
        _ => "send it elsewhere",
    };
    Failure::input(format!("standard output: {error}; {mend}"))
}
