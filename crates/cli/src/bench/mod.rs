//! `tyndall bench`: tables of this machine's speed; where there is a rival, as ratios measured by turns in one run.

mod core;
mod edit;
mod gathering;
mod growth;
mod historygram_figures;
mod historygrams;
mod looks;
mod photon_scenes;
mod samples;
mod scene_edits;
mod scenes;
mod timing;

use crate::args::{BenchName, BenchOptions};
use crate::{Failure, say};
use serde_json::{Value, json};
use tyndall::simd::Level;

/// One figure.
pub struct Row {
    /// Title of its table.
    pub table: &'static str,
    /// The case that was measured.
    pub row: String,
    /// The quantity that was measured.
    pub quantity: &'static str,
    /// The figure's unit; "ratio" has none.
    pub unit: &'static str,
    /// What was measured here.
    pub ours: f64,
    /// What the figure should be.
    pub target: Option<Target>,
    /// The paper's figure, on its machine and data.
    pub paper: Option<f64>,
}

/// What a figure should be.
#[derive(Clone, Copy)]
pub enum Target {
    AtLeast(f64),
    AtMost(f64),
}

impl Target {
    fn is_met_by(self, figure: f64) -> bool {
        match self {
            Self::AtLeast(floor) => figure >= floor,
            Self::AtMost(ceiling) => figure <= ceiling,
        }
    }
}

impl Row {
    /// A figure without a target.
    pub fn new(
        table: &'static str,
        row: impl Into<String>,
        quantity: &'static str,
        unit: &'static str,
        ours: f64,
    ) -> Self {
        Self { table, row: row.into(), quantity, unit, ours, target: None, paper: None }
    }

    /// With the target of at least so much.
    pub fn at_least(mut self, floor: f64) -> Self {
        self.target = Some(Target::AtLeast(floor));
        self
    }

    /// With the target of at most so much.
    pub fn at_most(mut self, ceiling: f64) -> Self {
        self.target = Some(Target::AtMost(ceiling));
        self
    }

    /// Beside the paper's figure.
    pub fn beside(mut self, paper: Option<f64>) -> Self {
        self.paper = paper;
        self
    }

    fn target(&self) -> String {
        match self.target {
            None => String::new(),
            Some(Target::AtLeast(floor)) => format!(">= {floor}"),
            Some(Target::AtMost(ceiling)) => format!("<= {ceiling}"),
        }
    }

    fn json(&self, reduced: bool) -> Value {
        json!({
            "table": self.table, "row": self.row, "quantity": self.quantity, "unit": self.unit,
            "paper": self.paper, "ours": self.ours, "reduced": reduced, "extrapolated": false, "target": self.target(),
        })
    }

    /// A cell of a Markdown table: the figure, bold if it misses its target, and the paper's beside it.
    fn cell(&self) -> String {
        let met = self.target.is_none_or(|target| target.is_met_by(self.ours));
        let ours = short(self.ours);
        let ours = if met { ours } else { format!("**{ours}**") };
        self.paper.map_or(ours.clone(), |paper| format!("{ours} / {paper}"))
    }

    fn line(&self) -> String {
        let Self { row, quantity, unit, ours, .. } = self;
        let paper = self.paper.map_or(String::new(), |paper| format!("paper {paper}"));
        let line = format!("{row:<44} {quantity:<34} {ours:>10.3} {unit:<8} {:<10} {paper}", self.target());
        line.trim_end().to_owned() + "\n"
    }
}

/// A figure with three digits that count.
fn short(x: f64) -> String {
    let decimals = match x.abs() {
        0.0 | 100.0.. => 0,
        10.0.. => 1,
        1.0.. => 2,
        0.01.. => 3,
        _ => 5,
    };
    format!("{x:.decimals$}")
}

/// A table for the documentation: a line for each case and a column for each quantity, in the order in which they were measured.
fn markdown(title: &str, rows: &[Row]) -> String {
    let mut columns: Vec<(&'static str, &'static str)> = Vec::new();
    let mut cases: Vec<&str> = Vec::new();
    for row in rows {
        if !columns.contains(&(row.quantity, row.unit)) {
            columns.push((row.quantity, row.unit));
        }
        if !cases.contains(&row.row.as_str()) {
            cases.push(&row.row);
        }
    }
    let mut text = format!("\n### {title}\n\n| |");
    let of = |column: (&'static str, &'static str)| {
        rows.iter().filter(move |row| (row.quantity, row.unit) == column)
    };
    for &(quantity, unit) in &columns {
        let mut targets: Vec<String> =
            of((quantity, unit)).map(Row::target).filter(|t| !t.is_empty()).collect();
        targets.dedup();
        let targets = if targets.is_empty() { String::new() } else { format!(" ({})", targets.join("; ")) };
        let unit = if unit == "ratio" { String::new() } else { format!(", {unit}") };
        text += &format!(" {quantity}{unit}{targets} |");
    }
    text += &format!("\n| --- |{}\n", " --- |".repeat(columns.len()));
    for case in cases {
        text += &format!("| {case} |");
        for &column in &columns {
            let cell = of(column).find(|row| row.row == case).map_or(String::new(), Row::cell);
            text += &format!(" {cell} |");
        }
        text += "\n";
    }
    text
}

/// Measures the rows of one table with the given vector instructions.
type Table = fn(&timing::Effort, Level) -> Result<Vec<Row>, Failure>;

/// The same, for tables that depend on the command line.
type Measure<'a> = dyn Fn(&timing::Effort, Level) -> Result<Vec<Row>, Failure> + 'a;

const CORE: &[Table] = &[
    core::sampling,
    core::flight,
    core::paths,
    core::threads,
    core::latency,
    scene_edits::costs,
    growth::curves,
];

const HISTORYGRAMS: &[Table] = &[
    historygrams::cornell_box,
    historygrams::ct,
    historygrams::hard,
    historygram_figures::figure_7,
    historygram_figures::figure_8,
    historygram_figures::figure_9,
    historygram_figures::defaults,
    gathering::estimates,
    samples::edits,
];

/// Measures the tables and prints each as soon as it is complete, or all at the end as JSON.
pub fn run(options: &BenchOptions) -> Result<(), Failure> {
    if let (BenchName::Core | BenchName::Historygrams, Some(file)) = (options.name, options.files.first()) {
        let file = tyndall::message::path_name(file);
        return Err(Failure::usage(format!(
            "{file}: only `looks` measures files; name it, or leave the file out"
        )));
    }
    let level = crate::machine::vector_instructions()?;
    let effort = timing::Effort::new(options.quick);
    let mut all = Vec::new();
    let edits = |effort: &timing::Effort, level| looks::edits(effort, level, &options.files);
    let looks: [&Measure; 2] = [&edits, &looks::look];
    let fixed = |tables: &'static [Table]| tables.iter().map(|table| table as _);
    let tables: Vec<_> = match options.name {
        BenchName::Core => fixed(CORE).collect(),
        BenchName::Historygrams => fixed(HISTORYGRAMS).collect(),
        BenchName::Looks => looks.to_vec(),
        BenchName::All => fixed(CORE).chain(looks).chain(fixed(HISTORYGRAMS)).collect(),
    };
    for table in tables {
        let rows = table(&effort, level)?;
        let title = rows.first().map_or("", |row| row.table);
        if options.markdown {
            say(&markdown(title, &rows))?;
        } else if !options.json {
            say(&format!("\n{title}\n{}", rows.iter().map(Row::line).collect::<String>()))?;
        }
        all.extend(rows);
    }
    if options.json {
        let rows: Vec<Value> = all.iter().map(|row| row.json(options.quick)).collect();
        say(&format!("{:#}\n", Value::Array(rows)))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_markdown_table_has_a_line_for_each_case_and_a_column_for_each_quantity() {
        let rows = [
            Row::new("t", "a", "time", "s", 0.123_456),
            Row::new("t", "a", "speed-up", "ratio", 9.0).at_least(10.0).beside(Some(15.2)),
            Row::new("t", "b", "time", "s", 1234.5),
            Row::new("t", "c", "speed-up", "ratio", 20.04).at_least(10.0),
        ];
        let expected = "\n### t\n\n| | time, s | speed-up (>= 10) |\n| --- | --- | --- |\n\
            | a | 0.123 | **9.00** / 15.2 |\n| b | 1234 |  |\n| c |  | 20.0 |\n";
        assert_eq!(markdown("t", &rows), expected);
    }
}
