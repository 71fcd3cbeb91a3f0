//! From rows in file order to rows in strictly increasing time, counting what is dropped and moved.

use armcal_core::robust::percentile_in;

/// Counts of cleaning.
#[derive(Debug, Default, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Counts {
    pub non_finite: u64,
    pub unstamped: u64,
    pub backward: u64,
    pub duplicate: u64,
}

/// The rows that are used, in order of time.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Kept {
    /// Time of each.
    pub time_ns: Vec<i64>,
    /// Which row of the file each is; `None` while it is every one of them in file order, as it mostly is.
    file_row: Option<Vec<usize>>,
}

impl Kept {
    pub fn len(&self) -> usize {
        self.time_ns.len()
    }

    /// The place in the file of each row.
    pub fn file_rows(&self) -> impl Iterator<Item = usize> + Clone {
        (0..self.len()).map(|place| self.file_row.as_ref().map_or(place, |rows| rows[place]))
    }

    /// Drops rows, given the time of each and its place in the file; how many they were.
    pub fn drop_where(&mut self, mut drop: impl FnMut(i64, usize) -> bool) -> u64 {
        let before = self.len();
        let mut kept = 0;
        for place in 0..before {
            let (time_ns, row) =
                (self.time_ns[place], self.file_row.as_ref().map_or(place, |rows| rows[place]));
            if drop(time_ns, row) {
                self.file_row.get_or_insert_with(|| (0..before).collect());
                continue;
            }
            if let Some(rows) = &mut self.file_row {
                (self.time_ns[kept], rows[kept]) = (time_ns, row);
            }
            kept += 1;
        }
        self.time_ns.truncate(kept);
        self.file_row.iter_mut().for_each(|rows| rows.truncate(kept));
        (before - kept) as u64
    }

    /// The values of these rows in their order, of columns in file order.
    pub fn of_columns(&self, columns: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
        match &self.file_row {
            None => columns,
            Some(rows) => columns.iter().map(|column| rows.iter().map(|i| column[*i]).collect()).collect(),
        }
    }
}

/// The usable rows, sorted by time; rows with equal stamps stay in file order and are all kept.
/// `finite(i)` says whether row `i` has only finite numbers.
pub(crate) fn in_time_order(time_ns: &[Option<i64>], finite: impl Fn(usize) -> bool) -> (Kept, Counts) {
    let mut counts = Counts::default();
    let all = time_ns.iter().map(|time| time.unwrap_or(i64::MIN)).collect();
    let mut kept = Kept { time_ns: all, file_row: None };
    let mut latest = i64::MIN;
    kept.drop_where(|_, i| {
        let Some(time) = time_ns[i] else {
            counts.unstamped += 1;
            return true;
        };
        if !finite(i) {
            counts.non_finite += 1;
            return true;
        }
        counts.backward += u64::from(time < latest);
        latest = latest.max(time);
        false
    });
    if counts.backward > 0 {
        let mut rows: Vec<(i64, usize)> = kept.time_ns.iter().copied().zip(kept.file_rows()).collect();
        rows.sort_by_key(|(time, _)| *time);
        let (time_ns, file_row) = rows.into_iter().unzip();
        kept = Kept { time_ns, file_row: Some(file_row) };
    }
    (kept, counts)
}

/// Keeps the first of rows with the same stamp.
pub(crate) fn drop_duplicates(rows: &mut Kept, counts: &mut Counts) {
    let mut before = None;
    counts.duplicate += rows.drop_where(|time_ns, _| before.replace(time_ns) == Some(time_ns));
}

/// Median rate [Hz] and largest gap [s]; both 0 for fewer than two rows.
pub(crate) fn rate_and_gap(time_ns: &[i64]) -> (f64, f64) {
    let mut steps_s: Vec<f64> = time_ns.windows(2).map(|w| w[1].saturating_sub(w[0]) as f64 * 1e-9).collect();
    if steps_s.is_empty() {
        return (0.0, 0.0);
    }
    let largest_s = steps_s.iter().copied().fold(0.0, f64::max);
    (1.0 / percentile_in(&mut steps_s, 0.5), largest_s)
}

/// Step of the grid all values lie on, if they lie on one.
///
/// The candidate is the smallest difference between distinct values. On a grid, nearly all differences between
/// neighbouring values are small whole multiples of it; for continuous readings the smallest difference is far
/// smaller than the others, which are then no small multiples.
pub(crate) fn quantisation_step(values: &[f64]) -> Option<f64> {
    const LOOKED_AT: usize = 50_000;
    const LARGEST_MULTIPLE: f64 = 30.5;
    let mut distinct: Vec<f64> = values.iter().step_by(values.len() / LOOKED_AT + 1).copied().collect();
    let looked_at = distinct.len();
    distinct.sort_by(f64::total_cmp);
    let scale = distinct.first()?.abs().max(distinct.last()?.abs());
    distinct.dedup_by(|a, b| (*a - *b).abs() <= 1e-9 * scale);
    if distinct.len() < 4 || looked_at < 20 {
        return None;
    }
    let steps: Vec<f64> = distinct.windows(2).map(|w| w[1] - w[0]).collect();
    let smallest = steps.iter().copied().fold(f64::INFINITY, f64::min);
    let small: Vec<f64> = steps.iter().copied().filter(|d| d / smallest < LARGEST_MULTIPLE).collect();
    let whole = |d: &&f64| (**d / smallest - (**d / smallest).round()).abs() < 0.05;
    let on_grid = small.iter().filter(whole).count();
    if (small.len() as f64) < 0.8 * steps.len() as f64 || (on_grid as f64) < 0.98 * small.len() as f64 {
        return None;
    }
    let multiples: f64 = small.iter().filter(whole).map(|d| (d / smallest).round()).sum();
    Some(small.iter().filter(whole).sum::<f64>() / multiples)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn backward_rows_are_sorted_and_duplicates_dropped() {
        let time = [Some(10), Some(30), Some(20), Some(30), None, Some(40), Some(50)];
        let (mut rows, mut counts) = in_time_order(&time, |i| i != 5);
        drop_duplicates(&mut rows, &mut counts);
        assert_eq!(rows, Kept { time_ns: vec![10, 20, 30, 50], file_row: Some(vec![0, 2, 1, 6]) });
        assert_eq!(counts, Counts { non_finite: 1, unstamped: 1, backward: 1, duplicate: 1 });
    }

    #[test]
    fn rate_is_the_median_and_the_gap_the_largest() {
        let time: Vec<i64> = [0, 10, 20, 30, 130, 140].map(|ms| ms * 1_000_000).into();
        let (rate_hz, gap_s) = rate_and_gap(&time);
        assert!((rate_hz - 100.0).abs() < 1e-9 && (gap_s - 0.1).abs() < 1e-12);
    }

    #[test]
    fn a_grid_is_found_and_noise_is_not_one() {
        // The step of a real recording: 25 / 65536 rad.
        let step = 25.0 / 65536.0;
        let smooth = |i: usize| (i as f64 * 1e-3).sin();
        let on_grid: Vec<f64> = (0..8000).map(|i| (smooth(i) / step).round() * step).collect();
        let found = quantisation_step(&on_grid).expect("a grid");
        assert!((found / step - 1.0).abs() < 1e-9, "{found}");
        let single: Vec<f64> = on_grid.iter().map(|v| f64::from(*v as f32)).collect();
        let found = quantisation_step(&single).expect("a grid in single precision");
        assert!((found / step - 1.0).abs() < 1e-3, "{found}");
        let continuous: Vec<f64> = (0..8000).map(smooth).collect();
        assert_eq!(quantisation_step(&continuous), None);
        assert_eq!(quantisation_step(&[1.0; 100]), None);
    }
}
