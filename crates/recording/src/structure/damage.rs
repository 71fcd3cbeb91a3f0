//! What is wrong with a file, told in so many places at most: a file can hold millions of faults.

/// Places of damage told one by one; of more, only how many there are.
const TOLD: usize = 50;

/// Something wrong with a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Damage {
    /// Where [byte].
    pub offset: usize,
    /// What.
    pub why: String,
    /// Whether what was read disagrees with what was written; otherwise it is only worth knowing.
    pub lost: bool,
}

/// Faults of one file or block, the first of them in words.
#[derive(Debug, Clone, Default)]
pub(crate) struct Faults {
    told: Vec<Damage>,
    /// How many more, the first place of one of them, and whether data were lost by any.
    more: u64,
    more_from: usize,
    more_lost: bool,
}

impl Faults {
    /// Adds data lost at a place; words are made only where they are kept.
    pub fn lost(&mut self, offset: usize, why: impl FnOnce() -> String) {
        if self.told.len() < TOLD {
            self.told.push(Damage { offset, why: why(), lost: true });
        } else {
            self.count(1, offset, true);
        }
    }

    /// Adds faults that are in words already.
    pub fn extend(&mut self, all: impl IntoIterator<Item = Damage>) {
        for damage in all {
            if self.told.len() < TOLD {
                self.told.push(damage);
            } else {
                self.count(1, damage.offset, damage.lost);
            }
        }
    }

    pub fn merge(&mut self, other: Faults) {
        self.extend(other.told);
        if other.more > 0 {
            self.count(other.more, other.more_from, other.more_lost);
        }
    }

    fn count(&mut self, more: u64, from: usize, lost: bool) {
        self.more_from = if self.more == 0 { from } else { self.more_from.min(from) };
        self.more += more;
        self.more_lost |= lost;
    }

    /// By offset, and last how many more there are.
    pub fn in_words(mut self) -> Vec<Damage> {
        self.told.sort_by_key(|damage| damage.offset);
        if self.more > 0 {
            let why = format!("{} more places of damage from here on", self.more);
            self.told.push(Damage { offset: self.more_from, why, lost: self.more_lost });
        }
        self.told
    }
}
