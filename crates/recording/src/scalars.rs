//! Scalar rows to a column.

use crate::decode::ScalarRows;

/// Values of one stream, row after row.
#[derive(Debug, Default)]
pub(crate) struct ScalarTable {
    pub value: Vec<f64>,
}

impl ScalarTable {
    pub fn of(rows: &ScalarRows) -> ScalarTable {
        ScalarTable { value: rows.value.clone() }
    }

    /// Adds the rows of a later block.
    pub fn append(&mut self, mut later: ScalarTable) {
        self.value.append(&mut later.value);
    }
}
