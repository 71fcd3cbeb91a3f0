//! Dwells of two results that are one and the same: the same readings at the same time.

use armcal_core::DwellMark;

/// A copy that was cut may begin and end some of its dwells a sample earlier or later; this share of them is exactly the
/// same in any copy, and in no other recording.
const LEAST_SHARE: f64 = 0.25;

/// Where a file is cut in a dwell, the middle of what is left moves by less than this [ns]: 1 s.
const CUT_NS: u64 = 1_000_000_000;

/// Which dwells of `own` another recording has too; all of them `false` where it is another recording, with less than a
/// quarter of the dwells exactly alike that the sparser one has while both were recorded.
pub fn also_in(own: &[DwellMark], other: &[DwellMark]) -> Vec<bool> {
    let mut sorted = other.to_vec();
    sorted.sort_unstable();
    if !is_copy(own, &sorted) {
        return vec![false; own.len()];
    }
    let near = |m: &DwellMark| {
        let next = sorted.partition_point(|o| o.time_ns < m.time_ns);
        let beside = sorted[next.saturating_sub(1)..].iter().take(2);
        beside.map(|o| o.time_ns.abs_diff(m.time_ns)).any(|apart| apart <= CUT_NS)
    };
    own.iter().map(near).collect()
}

/// Whether two recordings hold the same while both were recorded; `other` in the order of time.
fn is_copy(own: &[DwellMark], other: &[DwellMark]) -> bool {
    let times = own.iter().map(|m| m.time_ns);
    let (Some(first), Some(last)) = (other.first(), other.last()) else { return false };
    let (from, to) = (times.clone().min().unwrap_or(i64::MAX), times.max().unwrap_or(i64::MIN));
    let window = first.time_ns.max(from)..=last.time_ns.min(to);
    let inside = |marks: &[DwellMark]| marks.iter().filter(|m| window.contains(&m.time_ns)).count();
    let common = own.iter().filter(|m| other.binary_search(m).is_ok()).count();
    common > 0 && common as f64 >= LEAST_SHARE * inside(own).min(inside(other)) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn marks(dwells: std::ops::Range<i64>, seed: f64) -> Vec<DwellMark> {
        dwells.map(|k| DwellMark::of(k * 5_000_000_000, &[seed + k as f64, 0.1])).collect()
    }

    fn count(own: &[DwellMark], other: &[DwellMark]) -> usize {
        also_in(own, other).iter().filter(|in_both| **in_both).count()
    }

    #[test]
    fn parts_of_one_recording_share_what_both_hold() {
        let (a, b) = (marks(0..60, 0.3), marks(40..100, 0.3));
        assert_eq!((count(&a, &b), count(&b, &a), count(&a, &a)), (20, 20, 60));
        assert!(also_in(&b, &a)[..20].iter().all(|in_both| *in_both));
        // What was cut out of the middle of one is in the other alone.
        let ends: Vec<DwellMark> = a[..10].iter().chain(&a[50..]).copied().collect();
        assert_eq!((count(&a, &ends), count(&ends, &a)), (20, 20));
    }

    #[test]
    fn other_times_and_other_readings_are_other_dwells() {
        assert_eq!(count(&marks(0..60, 0.3), &marks(60..120, 0.3)), 0);
        assert_eq!(count(&marks(0..60, 0.3), &marks(0..60, 0.4)), 0);
        assert_eq!(count(&marks(0..60, 0.3), &[]), 0);
        assert_eq!(count(&[], &marks(0..60, 0.3)), 0);
        // A simulator that starts anew stands at the same place first, and goes elsewhere.
        let (a, mut b) = (marks(0..60, 0.3), marks(0..60, 0.4));
        b[0] = a[0];
        assert_eq!(count(&a, &b), 0);
    }

    #[test]
    fn a_copy_whose_dwells_end_a_sample_later_is_a_copy() {
        let a = marks(0..60, 0.3);
        let mut b = a.clone();
        b.iter_mut().step_by(2).for_each(|m| m.time_ns += 5_000_000);
        assert_eq!(count(&b, &a), 60);
    }
}
