//! The page and its parts: paragraphs, tables, bars with their answers.

use crate::{Options, machine};
use std::fmt::Write as _;

/// A bar of the design and what was measured.
pub struct Bar {
    /// What is measured.
    pub what: String,
    /// The bar.
    pub limit: String,
    /// What it came to.
    pub measured: String,
    /// Whether the bar is met.
    pub met: bool,
}

/// A table of Markdown.
pub struct Table {
    head: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl Table {
    /// A table without rows.
    pub fn new(head: &[&str]) -> Table {
        Table { head: head.iter().map(|&h| h.to_owned()).collect(), rows: Vec::new() }
    }

    /// Adds a row; the first cell is text, the others are numbers.
    pub fn row(&mut self, cells: impl IntoIterator<Item = String>) {
        self.rows.push(cells.into_iter().collect());
    }

    fn markdown(&self) -> String {
        let widths: Vec<usize> = (0..self.head.len())
            .map(|c| {
                self.rows.iter().chain([&self.head]).map(|row| row[c].chars().count()).max().unwrap_or(0)
            })
            .collect();
        let line = |row: &Vec<String>| {
            let cells = row.iter().zip(&widths).enumerate().map(|(c, (cell, &width))| match c {
                0 => format!("{cell:<width$}"),
                _ => format!("{cell:>width$}"),
            });
            format!("| {} |\n", cells.collect::<Vec<_>>().join(" | "))
        };
        let rule = widths.iter().enumerate().map(|(c, &width)| match c {
            0 => "-".repeat(width),
            _ => format!("{}:", "-".repeat(width.saturating_sub(1))),
        });
        let rule = format!("| {} |\n", rule.collect::<Vec<_>>().join(" | "));
        line(&self.head) + &rule + &self.rows.iter().map(line).collect::<String>()
    }
}

/// One part of the page.
pub struct Section {
    title: &'static str,
    said: Vec<String>,
    tables: Vec<Table>,
    /// Diagrams of Mermaid, which the page's readers draw.
    figures: Vec<String>,
    bars: Vec<Bar>,
    /// Of bars that were missed what they are made of.
    made_of: Vec<[String; 2]>,
    skipped: Vec<String>,
}

impl Section {
    /// An empty part.
    pub fn new(title: &'static str) -> Section {
        Section {
            title,
            said: Vec::new(),
            tables: Vec::new(),
            figures: Vec::new(),
            bars: Vec::new(),
            made_of: Vec::new(),
            skipped: Vec::new(),
        }
    }

    /// A paragraph.
    pub fn say(&mut self, text: impl Into<String>) {
        self.said.push(text.into());
    }

    /// A table.
    pub fn table(&mut self, table: Table) {
        self.tables.push(table);
    }

    /// A diagram of Mermaid.
    pub fn figure(&mut self, figure: String) {
        self.figures.push(figure);
    }

    /// A bar and its answer.
    pub fn bar(&mut self, bar: Bar) {
        self.bars.push(bar);
    }

    /// The same; where it was missed, what stands between it and what was measured.
    pub fn bar_of(&mut self, bar: Bar, made_of: impl FnOnce() -> String) {
        if !bar.met {
            self.made_of.push([bar.what.clone(), made_of()]);
        }
        self.bar(bar);
    }

    /// What could not be measured.
    pub fn skipped(&mut self, what: impl Into<String>) {
        self.skipped.push(what.into());
    }

    /// The part as Markdown.
    pub fn text(&self) -> String {
        let mut text = format!("## {}\n\n", self.title);
        for paragraph in &self.said {
            text += &wrapped(paragraph);
            text += "\n";
        }
        for table in &self.tables {
            text += &table.markdown();
            text += "\n";
        }
        for figure in &self.figures {
            text += &format!("```mermaid\n{figure}```\n\n");
        }
        if !self.bars.is_empty() {
            text += &bars(self.bars.iter());
            text += "\n";
        }
        for what in &self.skipped {
            text += &wrapped(&format!("**Not measured:** {what}."));
            text += "\n";
        }
        text
    }
}

/// The whole page.
pub fn page(sections: &[Section], options: &Options) -> String {
    let mut text = String::from("# Performance\n\n");
    let about = "Written by `cargo bench -p armcal --bench performance`; do not edit. Every number is of one run, where a part does not say otherwise, armcal \
                 and its peers taking turns on the same machine. CPU is time on a processor, of all threads: where wall \
                 time is longer, the machine was busy with something else. How often hidden effects are named rightly, and how \
                 often nothing is claimed where nothing is hidden, is counted by `armcal-dev score` (`docs/confusion.md`).";
    text += &wrapped(about);
    text += "\n";
    for fact in machine::facts(options) {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "- {fact}");
    }
    text += "\n## Bars\n\n";
    text += &bars(sections.iter().flat_map(|s| &s.bars));
    text += "\n";
    let missed: Vec<&[String; 2]> = sections.iter().flat_map(|s| &s.made_of).collect();
    if !missed.is_empty() {
        text += "What stands between bars that were missed and what was measured:\n\n";
    }
    for [what, made_of] in &missed {
        text += &wrapped(&format!("- *{what}*: {made_of}"));
    }
    text += if missed.is_empty() { "" } else { "\n" };
    text += &sections.iter().map(Section::text).collect::<Vec<_>>().join("");
    text.trim_end().to_owned() + "\n"
}

/// The page with one part measured anew, at its end where it was not yet on it; none where it has bars, which stand on its top too.
pub fn with(page: &str, section: &Section) -> Option<String> {
    let head = format!("## {}\n", section.title);
    let end = format!("{}\n\n", page.trim_end());
    let (before, rest) = page.split_once(&head).unwrap_or((&end, ""));
    let behind = rest.find("\n## ").map_or("", |at| &rest[at + 1..]);
    let text = section.text();
    let own = text.strip_prefix(&head).filter(|_| section.bars.is_empty())?;
    let when = wrapped(&format!("This part was measured by itself: {}.", machine::when().join("; ")));
    let page = format!("{before}{head}\n{when}{own}{behind}");
    Some(page.trim_end().to_owned() + "\n")
}

fn bars<'a>(bars: impl Iterator<Item = &'a Bar>) -> String {
    let mut table = Table::new(&["what", "bar", "measured", "met"]);
    for bar in bars {
        let met = if bar.met { "yes" } else { "**no**" };
        table.row([bar.what.clone(), bar.limit.clone(), bar.measured.clone(), met.to_owned()]);
    }
    table.markdown()
}

/// A number of seconds with three digits, in the unit that suits it.
pub fn seconds(value_s: f64) -> String {
    match value_s {
        v if v < 10.0 => format!("{v:.3}"),
        v => format!("{v:.1}"),
    }
}

/// Lines of up to 120 characters.
fn wrapped(paragraph: &str) -> String {
    let (mut text, mut column) = (String::new(), 0);
    for word in paragraph.split_whitespace() {
        let width = word.chars().count();
        if column > 0 && column + 1 + width > 120 {
            text.push('\n');
            column = 0;
        } else if column > 0 {
            text.push(' ');
            column += 1;
        }
        text += word;
        column += width;
    }
    text + "\n"
}
