//! Failures and their exit statuses.

use std::fmt::Display;
use std::process::ExitCode;

/// Why a command stopped; one message that names the input, what was found, what was expected and how to fix it.
#[derive(Debug)]
pub enum Failure {
    /// The input is at fault, or what it requests is not possible.
    Input(String),
    /// The command line is at fault.
    Usage(String),
    /// The user interrupted it; what had been rendered has been written.
    Interrupted,
}

impl Failure {
    /// The input is at fault.
    pub fn input(message: impl Display) -> Self {
        Self::Input(message.to_string())
    }

    /// The command line is at fault.
    pub fn usage(message: impl Display) -> Self {
        Self::Usage(message.to_string())
    }

    /// The same, with the part of the input that it concerns named first.
    pub fn within(self, part: &str) -> Self {
        match self {
            Self::Input(message) => Self::Input(format!("{part}: {message}")),
            other => other,
        }
    }

    /// What to print.
    pub fn message(&self) -> Option<&str> {
        match self {
            Self::Input(message) | Self::Usage(message) => Some(message),
            Self::Interrupted => None,
        }
    }

    /// The process's exit status.
    pub fn exit_code(&self) -> ExitCode {
        ExitCode::from(match self {
            Self::Input(_) => 1,
            Self::Usage(_) => 2,
            Self::Interrupted => 130,
        })
    }
}
