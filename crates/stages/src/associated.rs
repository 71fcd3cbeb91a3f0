//! Associations that were made already: most trials of a setup leave most recordings as they are.

use armcal_table::{Association, AssociationConfig, Board, BoardStart, DwellTip, TableError, associate};
use std::sync::{Arc, OnceLock};

/// Of each recording the first association that anybody asked for; whoever asks the same again is told the same.
#[derive(Debug, Clone, Default)]
pub struct Associated(Arc<Vec<OnceLock<(Asked, Association)>>>);

/// All that an association depends on.
#[derive(Debug, Clone, PartialEq)]
pub struct Asked {
    /// The cavities.
    pub board: Board,
    /// The tips of the recording's dwells.
    pub tips: Vec<DwellTip>,
    /// What is known of where the board is.
    pub start: BoardStart,
    /// The settings.
    pub config: AssociationConfig,
}

impl Associated {
    /// Nothing yet, of so many recordings; of none nothing is kept.
    pub fn nothing_yet(recordings: usize) -> Associated {
        Associated(Arc::new((0..recordings).map(|_| OnceLock::new()).collect()))
    }

    /// The association of a recording.
    pub fn of(&self, recording: usize, asked: Asked) -> Result<Association, TableError> {
        let first = self.0.get(recording);
        if let Some((_, known)) = first.and_then(OnceLock::get).filter(|(known, _)| *known == asked) {
            return Ok(known.clone());
        }
        let Asked { board, tips, start, config } = &asked;
        let association = associate(board, tips, start, config)?;
        if let Some(first) = first {
            // Where two ask at once one of them is kept: it is the same for the same question.
            let _ = first.set((asked, association.clone()));
        }
        Ok(association)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use armcal_core::DwellId;
    use armcal_table::Cavity;
    use nalgebra::Vector3;

    fn asked(shift_m: f64) -> Asked {
        let at = |k: usize| Vector3::new(0.05 * (k % 3) as f64, 0.05 * (k / 3) as f64, 0.0);
        let cavity = |k: usize| Cavity { name: format!("hole{k}"), in_board_m: at(k) };
        let tip = |dwell: usize| DwellTip {
            dwell: DwellId { recording: 0, dwell },
            start_ns: dwell as i64 * 1_000_000_000,
            end_ns: dwell as i64 * 1_000_000_000 + 500_000_000,
            predicted_m: at(dwell) + Vector3::new(shift_m, 0.0, 0.0),
            measured_m: None,
        };
        Asked {
            board: Board {
                name: "nine".to_owned(),
                cavity_sigma_m: 1e-4,
                seat_sigma_m: 1e-4,
                mechanism: None,
                cavities: (0..9).map(cavity).collect(),
            },
            tips: (0..9).map(tip).collect(),
            start: BoardStart::Known(armcal_core::Pose::identity()),
            config: AssociationConfig::default(),
        }
    }

    #[test]
    fn what_was_asked_first_is_told_again_and_nothing_else_is() {
        let known = Associated::nothing_yet(1);
        let alone = |asked: Asked| Associated::default().of(0, asked).expect("nine cavities");
        for shift_m in [0.0, 0.002, 0.0] {
            let told = known.of(0, asked(shift_m)).expect("nine cavities");
            assert_eq!(told, alone(asked(shift_m)), "{shift_m}");
        }
        let (first, _) = known.0[0].get().expect("it was asked for");
        assert_eq!(*first, asked(0.0));
        // A recording beyond those that are kept is associated all the same.
        assert_eq!(known.of(7, asked(0.001)).expect("nine cavities"), alone(asked(0.001)));
    }
}
