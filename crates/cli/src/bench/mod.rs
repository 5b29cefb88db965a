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
mod scans;
mod scene_edits;
mod scenes;
mod timing;

use crate::args::{BenchName, BenchOptions};
use crate::progress::Display;
use crate::{Failure, say};
use serde_json::{Value, json};
use std::path::PathBuf;
use tyndall::message::{excerpt, path_name};
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
        let mut targets: Vec<String> = Vec::new();
        for target in of((quantity, unit)).map(Row::target) {
            if !target.is_empty() && !targets.contains(&target) {
                targets.push(target);
            }
        }
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

/// A table: its rows, and what it may take.
pub struct Table {
    /// By which `--table` selects it.
    name: &'static str,
    /// About what it takes on two idle cores. Once these are over no edit is repeated, so that a set ends in time.
    seconds: f64,
    measure: Measure,
}

/// Measures the rows of a table.
type Measure = fn(&Run) -> Result<Vec<Row>, Failure>;

/// What tables are measured with.
pub struct Run<'a> {
    effort: timing::Effort,
    /// The vector instructions.
    level: Level,
    /// Scenes or volumes of the command line.
    files: &'a [PathBuf],
    scans: Vec<scans::Scan>,
}

const fn table(name: &'static str, seconds: f64, measure: Measure) -> Table {
    Table { name, seconds, measure }
}

const CORE: &[Table] = &[
    table("sampling", 5.0, |run| core::sampling(&run.effort, run.level)),
    table("flight", 5.0, |run| core::flight(&run.effort, run.level)),
    table("paths", 5.0, |run| core::paths(&run.effort, run.level)),
    table("threads", 10.0, |run| core::threads(&run.effort, run.level)),
    table("latency", 35.0, |run| core::latency(&run.effort, run.level)),
    table("costs", 10.0, |run| scene_edits::costs(&run.effort, run.level)),
    table("growth", 30.0, |run| growth::curves(&run.effort, run.level)),
    table("first-pictures", 240.0, |run| scans::first_pictures(&run.effort, run.level, &run.scans)),
];

const LOOKS: &[Table] = &[
    table("edits", 60.0, |run| looks::edits(&run.effort, run.level, run.files)),
    table("look", 10.0, |run| looks::look(&run.effort, run.level)),
];

const HISTORYGRAMS: &[Table] = &[
    table("cornell-box", 25.0, |run| historygrams::cornell_box(&run.effort, run.level)),
    table("ct", 30.0, |run| historygrams::ct(&run.effort, run.level)),
    table("hard", 20.0, |run| historygrams::hard(&run.effort, run.level)),
    table("figure-7", 30.0, |run| historygram_figures::figure_7(&run.effort, run.level)),
    table("figure-8", 30.0, |run| historygram_figures::figure_8(&run.effort, run.level)),
    table("figure-9", 40.0, |run| historygram_figures::figure_9(&run.effort, run.level)),
    table("defaults", 10.0, |run| historygram_figures::defaults(&run.effort, run.level)),
    table("scans", 120.0, |run| scans::edits(&run.effort, run.level, &run.scans)),
    table("gathering", 20.0, |run| gathering::estimates(&run.effort, run.level)),
    table("path", 10.0, |run| samples::edits(&run.effort, run.level)),
];

/// Measures the tables and prints each as soon as it is complete, or all at the end as JSON.
pub fn run(options: &BenchOptions) -> Result<(), Failure> {
    let tables = chosen(options)?;
    let scans = match tables.iter().any(|table| SCANS.contains(&table.name)) {
        true => scans::find(options.data.as_deref())?,
        false => Vec::new(),
    };
    let display = Display::new(options.progress, options.quiet);
    let effort = timing::Effort::new(options.quick, &tables, display);
    let level = crate::machine::vector_instructions()?;
    let run = Run { effort, level, files: &options.files, scans };
    let measured = measure(&tables, &run, options);
    run.effort.finish();
    measured
}

fn measure(tables: &[&Table], run: &Run, options: &BenchOptions) -> Result<(), Failure> {
    let mut all = Vec::new();
    for table in tables {
        run.effort.begin(table);
        let rows = (table.measure)(run)?;
        let title = rows.first().map_or("", |row| row.table);
        if options.markdown {
            run.effort.aside(|| say(&markdown(title, &rows)))?;
        } else if !options.json {
            let lines = rows.iter().map(Row::line).collect::<String>();
            run.effort.aside(|| say(&format!("\n{title}\n{lines}")))?;
        }
        all.extend(rows);
    }
    if options.json {
        let rows: Vec<Value> = all.iter().map(|row| row.json(options.quick)).collect();
        run.effort.aside(|| say(&format!("{:#}\n", Value::Array(rows))))?;
    }
    Ok(())
}

/// The tables that measure scans.
const SCANS: [&str; 2] = ["first-pictures", "scans"];

/// The table that measures the files of the command line.
const EDITS: &str = "edits";

/// The tables of the command line, in the order in which they are listed above.
fn chosen(options: &BenchOptions) -> Result<Vec<&'static Table>, Failure> {
    let sets: &[&'static [Table]] = match options.name {
        BenchName::Core => &[CORE],
        BenchName::Historygrams => &[HISTORYGRAMS],
        BenchName::Looks => &[LOOKS],
        BenchName::All => &[CORE, LOOKS, HISTORYGRAMS],
    };
    let of_set = || sets.iter().copied().flatten();
    let named = |name: &str| of_set().any(|table| table.name == name);
    if let Some(unknown) = options.tables.iter().find(|name| !named(name)) {
        let names: Vec<&str> = of_set().map(|table| table.name).collect();
        return Err(Failure::usage(format!(
            "--table {}: no such table here; expected one of {}",
            excerpt(unknown),
            names.join(", ")
        )));
    }
    let is_chosen =
        |table: &Table| options.tables.is_empty() || options.tables.iter().any(|name| name == table.name);
    let tables: Vec<&Table> = of_set().filter(|table| is_chosen(table)).collect();
    let measures = |name: &str| tables.iter().any(|table| table.name == name);
    if let Some(file) = options.files.first().filter(|_| !measures(EDITS)) {
        return Err(Failure::usage(format!(
            "{}: only `looks` measures files; name it, or leave the file out",
            path_name(file)
        )));
    }
    if let Some(folder) = options.data.as_ref().filter(|_| !SCANS.into_iter().any(measures)) {
        let [first, edits] = SCANS;
        return Err(Failure::usage(format!(
            "--data {}: only the tables `{first}` of `core` and `{edits}` of `historygrams` measure scans; name one, or leave the option out",
            path_name(folder)
        )));
    }
    Ok(tables)
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_help_names_every_table_in_order() {
        let command = crate::args::Args::command();
        let bench = command.find_subcommand("bench").expect("the command");
        let table = bench.get_arguments().find(|argument| argument.get_id() == "tables").expect("the option");
        let help = table.get_long_help().expect("a help").to_string();
        for (set, tables) in [("core", CORE), ("looks", LOOKS), ("historygrams", HISTORYGRAMS)] {
            let names: Vec<&str> = tables.iter().map(|table| table.name).collect();
            let expected = format!("{set}: {}", names.join(", "));
            assert!(help.contains(&expected), "{expected}, in: {help}");
        }
    }

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
