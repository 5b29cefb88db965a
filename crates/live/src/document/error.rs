//! What is wrong with a document: where, what was found, what was expected, and the mend.

use std::fmt;

use serde_json::Value;
use thiserror::Error;

use tyndall::message::{excerpt, quoted};

/// A document that does not describe a scene.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum DocumentError {
    /// The text is not of its language.
    #[error("line {line}, column {column}: {message}; expected a scene document in {language}")]
    Syntax {
        /// "TOML" or "JSON".
        language: &'static str,
        /// Line of the offending text, from 1.
        line: usize,
        /// Column of the offending text in characters, from 1.
        column: usize,
        /// What the parser says.
        message: String,
    },

    /// The text is sound but says something that a scene document must not say.
    #[error("{0}")]
    Content(Problems),
}

impl DocumentError {
    /// An error of one problem.
    pub(super) fn one(problem: Problem) -> Self {
        Self::Content(Problems { listed: vec![problem], more: false })
    }

    /// Every problem found; empty for an error of syntax.
    #[must_use]
    pub fn problems(&self) -> &[Problem] {
        match self {
            Self::Syntax { .. } => &[],
            Self::Content(problems) => &problems.listed,
        }
    }

    /// Path of the first problem, such as `lights.0.radiance`; empty for the document as a whole and for an error of
    /// syntax.
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
    /// How many are listed: a list of a million bad points makes no million lines.
    const LIMIT: usize = 20;

    pub(super) fn push(&mut self, problem: Problem) {
        if self.listed.len() < Self::LIMIT {
            self.listed.push(problem);
        } else {
            self.more = true;
        }
    }

    /// Whether further problems would not be listed.
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
        if self.more { write!(f, "\nand more; mend these first") } else { Ok(()) }
    }
}

/// One thing that is wrong with a document.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// Keys and indices from the root, joined by dots, such as `lights.0.radiance`; empty for the document as a whole.
    pub path: String,
    /// What stands there.
    pub found: String,
    /// What may stand there.
    pub expected: String,
    /// How to mend it, where that is not plain from what was expected.
    pub mend: Option<String>,
}

impl Problem {
    pub(super) fn new(
        path: impl Into<String>,
        found: impl Into<String>,
        expected: impl Into<String>,
    ) -> Self {
        Self { path: path.into(), found: found.into(), expected: expected.into(), mend: None }
    }

    pub(super) fn with_mend(self, mend: impl Into<String>) -> Self {
        Self { mend: Some(mend.into()), ..self }
    }
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let place = if self.path.is_empty() { "the document" } else { &self.path };
        write!(f, "{place}: found {}, expected {}", self.found, self.expected)?;
        match &self.mend {
            Some(mend) => write!(f, "; {mend}"),
            None => Ok(()),
        }
    }
}

/// `key` under `path`.
pub(super) fn join(path: &str, key: impl fmt::Display) -> String {
    let key = excerpt(&key.to_string());
    if path.is_empty() { key } else { format!("{path}.{key}") }
}

/// A value as an error names it.
pub(super) fn describe_value(value: &Value) -> String {
    match value {
        Value::Null => "null".to_owned(),
        Value::Bool(flag) => flag.to_string(),
        Value::Number(number) => number.to_string(),
        Value::String(text) => quoted(text),
        Value::Array(items) => format!("a list of {}", items.len()),
        Value::Object(_) => "a table".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_problem_names_place_finding_expectation_and_mend() {
        let problem = Problem::new(join("medium", "densty"), "an unknown key", "a key of `medium`");
        assert_eq!(problem.to_string(), "medium.densty: found an unknown key, expected a key of `medium`");
        let problem = problem.with_mend("did you mean `density`?");
        assert!(problem.to_string().ends_with("; did you mean `density`?"), "{problem}");
    }

    #[test]
    fn a_flood_of_problems_is_cut() {
        let mut problems = Problems::default();
        for i in 0..1000 {
            problems.push(Problem::new(i.to_string(), "x", "y"));
        }
        let error = problems.into_result().unwrap_err();
        assert_eq!(error.problems().len(), Problems::LIMIT);
        assert!(error.to_string().ends_with("and more; mend these first"), "{error}");
    }

    #[test]
    fn long_findings_are_cut_between_characters() {
        let long = Value::String("\u{e9}".repeat(1000));
        assert!(describe_value(&long).chars().count() < 70);
    }
}
