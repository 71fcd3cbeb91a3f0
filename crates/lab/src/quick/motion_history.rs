//! What the encoders went through before a dwell, as far as the pipeline keeps it.

use armcal_core::Arrival;

/// A joint has arrived from where it last was this far away [rad]: 0.3 deg.
const AWAY_RAD: f64 = 0.3 * std::f64::consts::PI / 180.0;

/// The pipeline forgets what lies beyond a turning point this far from another [rad].
const WIDEST_RAD: f64 = 0.25;

/// Direction of arrival of each joint at `rest_rad`.
pub fn arrival_directions(before: &[Vec<f64>], rest_rad: &[f64], count_rad: f64) -> Vec<Arrival> {
    let away = AWAY_RAD.max(3.0 * count_rad);
    let from = |(joint, rest): (usize, &f64)| {
        let moves = before.iter().rev().map(|row| rest - row[joint]);
        match moves.into_iter().find(|moved| moved.abs() >= away) {
            Some(moved) if moved > 0.0 => Arrival::Positive,
            Some(_) => Arrival::Negative,
            None => Arrival::Unknown,
        }
    };
    rest_rad.iter().enumerate().map(from).collect()
}

/// Turning points of each joint that no later and wider swing has wiped out, oldest first, the rest last [rad].
pub fn path_memories(before: &[Vec<f64>], rest_rad: &[f64], count_rad: f64) -> Vec<Vec<f64>> {
    let still = (0.1 * AWAY_RAD).max(3.0 * count_rad);
    let of = |(joint, rest): (usize, &f64)| turning_points_rad(before, |row| row[joint], *rest, still);
    rest_rad.iter().enumerate().map(of).collect()
}

/// The same of the sum and of the difference of each joint and the one before it [rad].
pub fn pair_memories(before: &[Vec<f64>], rest_rad: &[f64], count_rad: f64) -> Vec<[Vec<f64>; 2]> {
    let still = (0.1 * AWAY_RAD).max(6.0 * count_rad);
    let of = |joint: usize, sense: f64| {
        let together = |row: &[f64]| row[joint] + sense * row[joint - 1];
        turning_points_rad(before, together, together(rest_rad), still)
    };
    (1..rest_rad.len()).map(|joint| [of(joint, 1.0), of(joint, -1.0)]).collect()
}

/// How far each joint has come from its last rest [rad].
pub fn joint_moves_rad(from_rad: &[f64], rest_rad: &[f64]) -> Vec<f64> {
    rest_rad.iter().zip(from_rad).map(|(rest, from)| rest - from).collect()
}

fn turning_points_rad(
    before: &[Vec<f64>],
    of: impl Fn(&[f64]) -> f64,
    rest_rad: f64,
    still_rad: f64,
) -> Vec<f64> {
    let mut span = [rest_rad - still_rad, rest_rad + still_rad];
    // Newest first: the rest, then ever wider swings to alternating sides.
    let mut swings: Vec<(bool, f64)> = Vec::new();
    for row in before.iter().rev() {
        let q = of(row);
        let up = q > span[1];
        if !up && q >= span[0] {
            continue;
        }
        span[usize::from(up)] = q;
        match swings.last_mut() {
            Some((side, widest)) if *side == up => *widest = q,
            _ => swings.push((up, q)),
        }
        if span[1] - span[0] > WIDEST_RAD {
            break;
        }
    }
    swings.iter().rev().map(|(_, q)| *q).chain([rest_rad]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(column: &[f64]) -> Vec<Vec<f64>> {
        column.iter().map(|q| vec![*q]).collect()
    }

    #[test]
    fn swings_that_a_wider_one_followed_are_forgotten() {
        let path = rows(&[0.0, 0.10, 0.05, 0.08, 0.02, 0.06]);
        assert_eq!(path_memories(&path, &[0.04], 1e-6), vec![vec![0.0, 0.10, 0.02, 0.06, 0.04]]);
        assert_eq!(path_memories(&[], &[0.04], 1e-6), vec![vec![0.04]]);
    }

    #[test]
    fn a_joint_arrives_from_where_it_was_last_far_away() {
        let path = rows(&[0.0, 0.1, 0.204, 0.202]);
        assert_eq!(arrival_directions(&path, &[0.2], 1e-6), vec![Arrival::Positive]);
        assert_eq!(arrival_directions(&rows(&[0.0, 0.1, 0.206]), &[0.2], 1e-6), vec![Arrival::Negative]);
        assert_eq!(arrival_directions(&rows(&[0.2, 0.201]), &[0.2], 1e-6), vec![Arrival::Unknown]);
    }
}
