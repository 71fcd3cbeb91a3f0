//! How text is drawn in the terminal: tables, lists and verdicts, at most 100 columns wide, with colours or without.

use comfy_table::{Attribute, Cell, CellAlignment, Color, ContentArrangement, LineStyle, Table, TableStyle};

/// Widest line.
const COLUMNS: u16 = 100;

/// A thin rule below the header and nothing else: the numbers are the table.
pub const RULED: TableStyle = TableStyle::new().header_separator(LineStyle::none().fill('─').junction('─'));

/// Whether colour codes may be written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TerminalStyle {
    /// Text only.
    Plain,
    /// ANSI colours and bold.
    Colour,
}

/// A table of text without colours: a thin rule below the header and nothing else.
pub fn plain_table() -> Table {
    let mut table = Table::new();
    table.load_style(RULED).force_no_tty();
    table
}

/// A table line by line, without the blanks that fill it up.
pub fn table_text(table: &Table) -> String {
    table.lines().map(|line| format!("{}\n", line.trim_end())).collect()
}

/// A cell set flush right.
pub fn number_cell(value: impl ToString) -> Cell {
    Cell::new(value).set_alignment(CellAlignment::Right)
}

/// Draws tables in one style.
pub(crate) struct Pen {
    pub style: TerminalStyle,
}

impl Pen {
    pub fn table(&self, header: &[&str]) -> Table {
        let mut table = self.bare_table();
        table.load_style(RULED);
        table.set_header(header.iter().map(|h| Cell::new(h).add_attribute(Attribute::Dim)));
        table
    }

    fn bare_table(&self) -> Table {
        let mut table = Table::new();
        table.load_style(TableStyle::new());
        table.set_content_arrangement(ContentArrangement::Dynamic).set_width(COLUMNS);
        match self.style {
            TerminalStyle::Plain => table.force_no_tty(),
            TerminalStyle::Colour => table.enforce_styling(),
        };
        table
    }

    /// Sentences behind a short label, wrapped.
    pub fn list(&self, entries: impl Iterator<Item = (&'static str, String)>) -> String {
        let mut table = self.bare_table();
        for (label, text) in entries {
            table.add_row(vec![self.mark(Cell::new(label)), Cell::new(text)]);
        }
        self.render(&table)
    }

    pub fn mark(&self, cell: Cell) -> Cell {
        cell.fg(Color::Yellow)
    }

    pub fn render(&self, table: &Table) -> String {
        table_text(table)
    }

    pub fn section(&self, title: &str, body: String) -> String {
        format!("{}\n{body}", self.bold(title))
    }

    /// The result in one sentence, in the colour of whether it can be relied upon.
    pub fn verdict(&self, conclusion: &str, reliable: bool) -> String {
        let mut table = self.bare_table();
        let colour = if reliable { Color::Green } else { Color::Yellow };
        table.add_row(vec![Cell::new(conclusion).fg(colour).add_attribute(Attribute::Bold)]);
        self.render(&table)
    }

    pub fn bold(&self, text: &str) -> String {
        match self.style {
            TerminalStyle::Plain => text.to_owned(),
            TerminalStyle::Colour => format!("\u{1b}[1m{text}\u{1b}[0m"),
        }
    }
}
