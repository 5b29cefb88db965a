//! The program `tyndall`: parses, calls the library, and shows. No algorithm lives here.

mod args;
mod bench;
mod canvas;
mod edits;
mod failure;
mod info;
mod lists;
mod machine;
mod merge;
mod option_values;
mod output;
mod overrides;
mod parts;
mod progress;
mod refine;
mod render;
mod replay;
mod reserve;
mod sheet;
mod stats;
mod turntable;
mod video;

use args::{Args, Command};
use clap::{CommandFactory, Parser};
use failure::Failure;
use std::io::{ErrorKind, Write};
use std::process::ExitCode;
use std::time::Instant;
use tyndall::message::excerpt;

fn main() -> ExitCode {
    let started = Instant::now();
    let args = Args::try_parse().unwrap_or_else(|error| refuse(&error));
    let done = match args.command {
        Command::Render(options) => render::run(&options, started),
        Command::Replay(options) => replay::run(&options),
        Command::Merge(options) => merge::run(&options),
        Command::Info(options) => info::run(&options),
        Command::Bench(options) => bench::run(&options),
        Command::Sheet(options) => sheet::run(&options),
        Command::Presets => lists::presets(),
        Command::Looks => lists::looks(),
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
                // If stderr is closed the message is lost.
                drop(writeln!(std::io::stderr(), "tyndall: {message}"));
            }
            failure.exit_code()
        }
    }
}

/// Ends the program as clap would, except that arguments are quoted as in all messages: short, and without control
/// characters.
fn refuse(error: &clap::Error) -> ! {
    let mut words = std::env::args_os();
    let program = words.next();
    let shown = words.map(|word| excerpt(&word.to_string_lossy()).into());
    let shown = program.into_iter().chain(shown);
    // The same error, with arguments that are safe to print.
    Args::try_parse_from(shown).err().as_ref().unwrap_or(error).exit()
}

/// Writes to stdout; a closed pipe is a failure with a message, not a panic.
fn say(text: &str) -> Result<(), Failure> {
    let mut out = std::io::stdout().lock();
    out.write_all(text.as_bytes()).and_then(|()| out.flush()).map_err(|e| stdout_failure(&e))
}

/// The failure of a write to stdout.
fn stdout_failure(error: &std::io::Error) -> Failure {
    let fix = match error.kind() {
        ErrorKind::BrokenPipe => "its reader must stay open to the end",
        _ => "redirect it elsewhere",
    };
    Failure::input(format!("standard output: {error}; {fix}"))
}
