//! Whether the probabilities that are told are those of being right: the reliability curve.

use super::Scored;
use super::interval::Share;
use super::judge::holds_truth;
use std::fmt::Write as _;

/// Where bins of the told probability begin.
const FROM: [f64; 5] = [0.0, 0.5, 0.7, 0.9, 0.99];

/// A name told with this probability is told as good as sure.
const SURE: f64 = 0.9;

/// The names told, by the probability they were told with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Reliability {
    /// True ones and all, in each bin.
    bins: [[usize; 2]; FROM.len()],
}

impl Reliability {
    /// Every effect found is one name told, alone or as a set; true where that holds something that is hidden.
    pub fn of<'a>(scored: impl Iterator<Item = &'a Scored>) -> Reliability {
        let mut bins = [[0; 2]; FROM.len()];
        for s in scored {
            for (set, probability) in s.answer.sets.iter().zip(&s.answer.set_probabilities) {
                let bin = &mut bins[FROM.iter().rposition(|from| probability >= from).unwrap_or(0)];
                bin[0] += usize::from(holds_truth(set, &s.hidden));
                bin[1] += 1;
            }
        }
        Reliability { bins }
    }

    /// Those that were told with at least this probability.
    fn told_with(&self, least: f64) -> Share {
        let bins = self.bins.iter().zip(FROM).filter(|(_, from)| *from >= least);
        bins.fold(Share { k: 0, n: 0 }, |sum, ([k, n], _)| Share { k: sum.k + k, n: sum.n + n })
    }

    /// `of 210 names told with 0.9 or more, 205 are true: 97.6 % (94.5 to 99.2)`.
    pub fn claim(&self) -> String {
        let share = self.told_with(SURE);
        format!("of {} names told with {SURE} or more, {} are true: {}", share.n, share.k, share.percent())
    }

    /// The section of the page; nothing where no name was told.
    pub(super) fn section(&self) -> String {
        if self.told_with(0.0).n == 0 {
            return String::new();
        }
        let mut text = String::from(
            "\n## Probabilities\n\nEvery name told on this page, by the probability it was told with; a set counts as one name, \
             true if it holds what is hidden.\n\n| probability | told | true | share true (95 %) |\n|---|---|---|---|\n",
        );
        let until = FROM.into_iter().skip(1).chain([1.0]);
        for ((from, until), [k, n]) in FROM.into_iter().zip(until).zip(self.bins) {
            let _ = writeln!(text, "| {from} to {until} | {n} | {k} | {} |", Share { k, n }.percent());
        }
        let _ = writeln!(text, "\nThat is: {}.", self.claim());
        text
    }
}

#[cfg(test)]
mod tests {
    use super::{FROM, Reliability, Share};
    use crate::page::tests::scored;
    use crate::{Judgement, Scored};

    /// One true name and one wrong one, told with this probability.
    fn told(probability: f64) -> Scored {
        let mut s =
            scored("backlash", 1, Judgement::Wrong, &[&["periodic:2", "backlash:2"], &["backlash:3"]]);
        s.answer.set_probabilities = vec![probability; 2];
        s
    }

    #[test]
    fn every_name_is_in_one_bin_and_the_claim_is_their_sum() {
        let all: Vec<Scored> = [0.0, 0.499, 0.5, 0.7, 0.899, 0.9, 0.99, 1.0].map(told).to_vec();
        let curve = Reliability::of(all.iter());
        assert_eq!(curve.bins, [[2, 4], [1, 2], [2, 4], [1, 2], [2, 4]]);
        assert_eq!(curve.told_with(0.0), Share { k: 8, n: 16 });
        assert!(curve.claim().starts_with("of 6 names told with 0.9 or more, 3 are true: 50.0 % ("));
        let section = curve.section();
        assert_eq!(section.lines().filter(|line| line.contains(" to ")).count(), FROM.len() + 1, "{section}");
        assert!(section.contains("\n| 0.99 to 1 | 4 | 2 | 50.0 % (6.8 to 93.2) |\n\nThat is: of 6 names"));
    }

    #[test]
    fn where_no_name_is_told_there_is_no_section() {
        let silent = [scored("nothing", 1, Judgement::RightlySilent, &[])];
        assert_eq!(Reliability::of(silent.iter()).section(), "");
    }
}
