//! Planted changes are found where they are, and nothing is found where nothing is.

use super::*;
use armcal_core::Unit;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

const DAY_NS: i64 = 86_400_000_000_000;

/// `n` recordings a week apart, in rows that are not in the order of time; `sigma` is told, `scatter` is not.
fn recorded(
    n: usize,
    [sigma, scatter]: [f64; 2],
    truth: impl Fn(usize) -> f64,
    rng: &mut ChaCha8Rng,
) -> Series {
    let total = sigma.hypot(scatter);
    let point = |k: usize, rng: &mut ChaCha8Rng| SeriesPoint {
        row: n - 1 - k,
        time_ns: k as i64 * 7 * DAY_NS,
        value: truth(k) + total * rng.sample::<f64, _>(StandardNormal),
        sigma: (sigma > 0.0).then_some(sigma),
    };
    let points = (0..n).map(|k| point(k, rng)).collect();
    Series { quantity: "joint1.theta".into(), unit: Unit::Radian, points }
}

#[test]
fn campaigns_without_a_change_rarely_show_one() {
    let mut alarms = 0;
    for seed in 0..400 {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let n = rng.random_range(4..60);
        let noise = [[1e-4, 0.0], [1e-4, 3e-4], [0.0, 1e-4]][seed as usize % 3];
        let all: Vec<Series> = (0..12).map(|_| recorded(n, noise, |_| 0.3, &mut rng)).collect();
        alarms += usize::from(!find_changes(&all).is_empty());
    }
    // 1 % of 400 is promised; 12 or more would happen once in a thousand.
    assert!(alarms <= 11, "{alarms} of 400 campaigns");
}

#[test]
fn a_step_is_found_between_its_recordings_with_its_size() {
    let (mut exact, mut inside, mut more) = (0, 0, 0);
    for seed in 0..100 {
        let mut rng = ChaCha8Rng::seed_from_u64(1000 + seed);
        let at = rng.random_range(3..27);
        let all = [recorded(30, [1e-4, 1e-4], |k| if k < at { 0.1 } else { 0.101 }, &mut rng)];
        let found = find_changes(&all);
        more += found.len() - 1;
        let surest = found.iter().min_by(|a, b| a.p.total_cmp(&b.p)).expect("a change");
        let ChangeKind::Step { before, after } = surest.kind else { panic!("{found:?}") };
        exact += usize::from((before, after) == (30 - at, 29 - at));
        let [low, high] = surest.ci95.expect("an interval");
        inside += usize::from(low < 1e-3 && 1e-3 < high);
    }
    // Two searches of one percent follow the first; 6 or more of 100 would happen once in sixty.
    assert!(more <= 5, "{more} further changes in 100");
    assert!(exact >= 95, "placed exactly in {exact} of 100");
    assert!(inside >= 88, "inside its interval in {inside} of 100");
}

#[test]
fn an_error_that_all_recordings_share_hides_no_step() {
    let mut rng = ChaCha8Rng::seed_from_u64(6);
    let mut series = recorded(20, [1e-4, 0.0], |k| if k < 12 { 0.0 } else { 1e-3 }, &mut rng);
    series.points.iter_mut().for_each(|p| p.sigma = Some(5e-2));
    assert_eq!(find_changes(&[series])[0].kind, ChangeKind::Step { before: 8, after: 7 });
}

#[test]
fn a_step_before_the_last_recording_is_seen_at_once() {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let all = [recorded(20, [1e-4, 0.0], |k| if k < 19 { 0.0 } else { 2e-3 }, &mut rng)];
    assert_eq!(find_changes(&all)[0].kind, ChangeKind::Step { before: 1, after: 0 });
}

#[test]
fn bumped_and_put_right_again() {
    let mut rng = ChaCha8Rng::seed_from_u64(8);
    let all = [recorded(40, [1e-4, 0.0], |k| if (12..25).contains(&k) { 1e-3 } else { 0.0 }, &mut rng)];
    let found = find_changes(&all);
    let sizes: Vec<bool> = found.iter().map(|c| c.size > 0.0).collect();
    assert_eq!(sizes, [true, false], "{found:?}");
    assert_eq!(found[0].kind, ChangeKind::Step { before: 28, after: 27 });
    assert_eq!(found[1].kind, ChangeKind::Step { before: 15, after: 14 });
}

#[test]
fn the_last_of_several_after_a_step_is_no_second_step() {
    let mut more = 0;
    for seed in 0..200 {
        let mut rng = ChaCha8Rng::seed_from_u64(5000 + seed);
        let all = [recorded(13, [1e-4, 1e-4], |k| if k < 9 { 0.0 } else { 1.5e-3 }, &mut rng)];
        let found = find_changes(&all);
        assert!(!found.is_empty());
        more += usize::from(found.len() > 1);
    }
    // The same; 10 or more of 200 would happen once in a hundred.
    assert!(more <= 9, "{more} of 200 show a second change");
}

#[test]
fn one_bad_recording_is_no_step() {
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    let all = [recorded(25, [1e-4, 5e-5], |k| if k == 10 { 3e-3 } else { 0.0 }, &mut rng)];
    let found = find_changes(&all);
    assert_eq!(found.len(), 1, "{found:?}");
    assert_eq!(found[0].kind, ChangeKind::Outlier { at: 14 });
    assert!((found[0].size - 3e-3).abs() < 5e-4);
}

#[test]
fn wear_is_a_trend_with_its_rate() {
    let mut inside = 0;
    for seed in 0..100 {
        let mut rng = ChaCha8Rng::seed_from_u64(3000 + seed);
        let all = [recorded(30, [1e-4, 1e-4], |k| 5e-5 * k as f64, &mut rng)];
        let found = find_changes(&all);
        assert_eq!(found.len(), 1, "{found:?}");
        assert_eq!(found[0].kind, ChangeKind::Trend { from: 29, to: 0 });
        let [low, high] = found[0].ci95.expect("an interval");
        inside += usize::from(low < 5e-5 / 7.0 && 5e-5 / 7.0 < high);
    }
    assert!(inside >= 88, "inside its interval in {inside} of 100");
}

#[test]
fn three_recordings_and_equal_values_say_nothing() {
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    assert!(find_changes(&[recorded(3, [1e-4, 0.0], |k| k as f64, &mut rng)]).is_empty());
    assert!(find_changes(&[recorded(30, [0.0, 0.0], |_| 0.2, &mut rng)]).is_empty());
    assert!(find_changes(&[recorded(30, [0.0, 1e-13], |_| 0.2, &mut rng)]).is_empty());
    let at_once = (0..9).map(|row| SeriesPoint { row, time_ns: 5, value: row as f64, sigma: None }).collect();
    let all = [Series { quantity: "x".into(), unit: Unit::Metre, points: at_once }];
    assert!(find_changes(&all).iter().all(|c| !matches!(c.kind, ChangeKind::Trend { .. })));
}

/// A series of these values a week apart, the first recording in the first row.
fn of_values(values: &[f64], sigma: Option<f64>) -> Series {
    let point = |(row, value): (usize, &f64)| SeriesPoint {
        row,
        time_ns: row as i64 * 7 * DAY_NS,
        value: *value,
        sigma,
    };
    let points = values.iter().enumerate().map(point).collect();
    Series { quantity: "joint1.theta".into(), unit: Unit::Radian, points }
}

#[test]
fn values_that_are_all_alike_do_not_say_how_much_they_scatter() {
    let stuck = [0.01, 0.01, 0.01, 0.03, 0.03, 0.03];
    let found = find_changes(&[of_values(&stuck, None)]);
    assert_eq!(found.iter().map(|c| c.ci95).collect::<Vec<_>>(), [None], "{found:?}");
    // What each recording knows of itself is then all that is known.
    let found = find_changes(&[of_values(&stuck, Some(1e-4))]);
    let [low, high] = found[0].ci95.expect("an interval");
    let sigma = 1e-4 * (2.0_f64 / 3.0).sqrt();
    assert!(0.5 * (high - low) > 2.77 * sigma, "{low} to {high}");
    // Six values that differ by less than they are known to: no change.
    assert!(find_changes(&[of_values(&stuck, Some(0.1))]).is_empty());
}

/// The size of a step that was picked out of many series because it stood out lies in its interval as often as promised,
/// though only two or three recordings stand on either side.
#[test]
fn intervals_of_steps_between_few_recordings_hold_what_they_promise() {
    let (mut inside, mut all) = (0, 0);
    for seed in 0..3000 {
        let mut rng = ChaCha8Rng::seed_from_u64(9000 + seed);
        let n = rng.random_range(4..7);
        let at = n / 2;
        // From steps that show by luck alone to those that mostly do: 3 to 40 times the scatter.
        let size = 10_f64.powf(rng.random_range(0.5..1.6)) * 1e-4;
        let truth = |series: usize| move |k: usize| if series == 0 && k >= at { size } else { 0.0 };
        let many: Vec<Series> = (0..12).map(|i| recorded(n, [0.0, 1e-4], truth(i), &mut rng)).collect();
        let right = ChangeKind::Step { before: n - at, after: n - 1 - at };
        for change in find_changes(&many).iter().filter(|c| c.kind == right) {
            let [low, high] = change.ci95.expect("an interval");
            all += 1;
            inside += usize::from(low < size && size < high);
        }
    }
    // Fewer would happen once in a thousand.
    assert!(
        all > 500 && inside as f64 > 0.95 * all as f64 - 3.1 * (0.0475 * all as f64).sqrt(),
        "{inside} of {all}"
    );
}
