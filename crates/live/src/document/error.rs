//! What is wrong with a document: where, what was found, what was expected, and how to fix it.

use std::fmt;

use serde_json::Value;
use thiserror::Error;

use tyndall::message::{excerpt, quoted};

/// A document that does not describe a scene.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum DocumentError {
    /// The text is not valid TOML or JSON.
    #[error("line {line}, column {column}: {message}; expected a scene document in {language}")]
    Syntax {
        /// "TOML" or "JSON".
        language: &'static str,
        /// Line of the offending text, from 1.
        line: usize,
        /// Column of the offending text in characters, from 1.
        column: usize,
        /// The parser's message.
        message: String,
    },

    /// The text is valid TOML or JSON, but not a valid scene document.
    #[error("{0}")]
    Content(Problems),
}

impl DocumentError {
    /// An error with one problem.
    pub(super) fn one(problem: Problem) -> Self {
        Self::Content(Problems { listed: vec![problem], more: false })
    }

    /// The problems found, up to a limit; empty for a syntax error.
    #[must_use]
    pub fn problems(&self) -> &[Problem] {
        match self {
            Self::Syntax { .. } => &[],
            Self::Content(problems) => &problems.listed,
        }
    }

    /// Path of the first problem, such as `lights.0.radiance`; empty for the document as a whole and for a syntax
    /// error.
    #[must_use]
    pub fn path(&self) -> &str {
        self.problems().first().map_or("", |problem| &problem.path)
    }
}

/// The first few problems of a document, in the order of its keys.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Problems {
    listed: Vec<Problem>,
    more: bool,
}

impl Problems {
    /// How many are listed at most, so that a list of a million bad points does not make a million lines.
    const LIMIT: usize = 20;

    pub(super) fn push(&mut self, problem: Problem) {
        if self.listed.len() < Self::LIMIT {
            self.listed.push(problem);
        } else {
            self.more = true;
        }
    }

    /// Whether there were more problems than are listed.
    pub(super) fn is_full(&self) -> bool {
        self.more
    }

    pub(super) fn into_result(self) -> Result<(), DocumentError> {
        if self.listed.is_empty() { Ok(()) } else { Err(DocumentError::Content(self)) }
    }
}

impl fmt::Display for Problems {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, problem) in self.listed.iter().enumerate() {
            let separator = if i == 0 { "" } else { "\n" };
            write!(f, "{separator}{problem}")?;
        }
        if self.more { write!(f, "\nand more; fix these first") } else { Ok(()) }
    }
}

/// One thing that is wrong with a document.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// Keys and indices from the root, joined by dots, such as `lights.0.radiance`; empty for the document as a whole.
    pub path: String,
    /// What was found there.
    pub found: String,
    /// What was expected there.
    pub expected: String,
    /// How to fix it, where that is not obvious from what was expected.
    pub fix: Option<String>,
}

impl Problem {
    pub(super) fn new(
        path: impl Into<String>,
        found: impl Into<String>,
        expected: impl Into<String>,
    ) -> Self {
        Self { path: path.into(), found: found.into(), expected: expected.into(), fix: None }
    }

    pub(super) fn with_fix(self, fix: impl Into<String>) -> Self {
        Self { fix: Some(fix.into()), ..self }
    }
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let place = if self.path.is_empty() { "the document" } else { &self.path };
        write!(f, "{place}: found {}, expected {}", self.found, self.expected)?;
        match &self.fix {
            Some(fix) => write!(f, "; {fix}"),
            None => Ok(()),
        }
    }
}

/// The path of `key` below `path`.
pub(super) fn join(path: &str, key: impl fmt::Display) -> String {
    let key = excerpt(&key.to_string());
    if path.is_empty() { key } else { format!("{path}.{key}") }
}

/// A value as described in messages.
pub(super) fn describe_value(value: &Value) -> String {
    match value {
        Value::Null => "null".to_owned(),
        Value::Bool(flag) => flag.to_string(),
        Value::Number(number) => number.to_string(),
        Value::String(text) => quoted(text),
        Value::Array(items) => format!("a list of length {}", items.len()),
        Value::Object(_) => "a table".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_says_where_what_was_found_what_was_expected_and_how_to_fix_it() {
        let problem = Problem::new(join("medium", "densty"), "an unknown key", "a key of `medium`");
        assert_eq!(problem.to_string(), "medium.densty: found an unknown key, expected a key of `medium`");
        let problem = problem.with_fix("did you mean `density`?");
        assert!(problem.to_string().ends_with("; did you mean `density`?"), "{problem}");
    }

    #[test]
    fn only_the_first_problems_are_listed() {
        let mut problems = Problems::default();
        for i in 0..1000 {
            problems.push(Problem::new(i.to_string(), "x", "y"));
        }
        let error = problems.into_result().unwrap_err();
        assert_eq!(error.problems().len(), Problems::LIMIT);
        assert!(error.to_string().ends_with("and more; fix these first"), "{error}");
    }

    #[test]
    fn long_values_are_cut_between_characters() {
        let long = Value::String("\u{e9}".repeat(1000));
        assert!(describe_value(&long).chars().count() < 70);
    }
}
