//! Recorded time: recordings one after the other, without the hours or days between them.

use crate::column::Column;
use armcal_core::Observation;
use armcal_core::robust::median;

/// When each recording begins on an axis of recorded time.
pub struct RecordedTime {
    /// Its first observation [ns], and where that stands on the axis [min]; none without observations.
    begins: Vec<Option<(i64, f64)>>,
    /// Usual time between two observations [min].
    step_min: f64,
}

impl RecordedTime {
    /// Of the observations of recordings.
    pub fn of(observations: &[Observation], recordings: usize) -> RecordedTime {
        RecordedTime::of_times(observations.iter().map(|o| (o.dwell.recording, o.time_ns)), recordings)
    }

    /// Of times [ns] in recordings, in the order of their first ones. Where one ends and the next begins stands one usual step
    /// between two times, so that no two of them fall together.
    pub fn of_times(times: impl IntoIterator<Item = (usize, i64)>, recordings: usize) -> RecordedTime {
        let mut times_ns: Vec<Vec<i64>> = vec![Vec::new(); recordings];
        for (recording, time_ns) in times {
            if let Some(own) = times_ns.get_mut(recording) {
                own.push(time_ns);
            }
        }
        times_ns.iter_mut().for_each(|own| own.sort_unstable());
        let steps: Vec<f64> =
            times_ns.iter().flat_map(|own| own.windows(2)).map(|w| ns_to_min(w[1] - w[0])).collect();
        let step_min = if steps.is_empty() { 0.0 } else { median(&steps) };
        let mut order: Vec<usize> = (0..recordings).filter(|r| !times_ns[*r].is_empty()).collect();
        order.sort_by_key(|r| (times_ns[*r][0], *r));
        let mut begins = vec![None; recordings];
        let mut elapsed_min = 0.0;
        for r in order {
            let (first_ns, last_ns) = (times_ns[r][0], times_ns[r][times_ns[r].len() - 1]);
            begins[r] = Some((first_ns, elapsed_min));
            elapsed_min += ns_to_min(last_ns - first_ns) + step_min;
        }
        RecordedTime { begins, step_min }
    }

    /// Where an observation stands [min].
    pub fn at_min(&self, o: &Observation) -> f64 {
        self.time_min(o.dwell.recording, o.time_ns)
    }

    /// Where a time in a recording stands [min].
    pub fn time_min(&self, recording: usize, time_ns: i64) -> f64 {
        let (first_ns, begin_min) = self.begins.get(recording).copied().flatten().unwrap_or_default();
        begin_min + ns_to_min(time_ns - first_ns)
    }

    /// Between the recordings [min]: nothing that is averaged or drawn as a line reaches across.
    pub fn cuts(&self) -> Vec<f64> {
        let begins = self.begins.iter().flatten().map(|(_, begin_min)| *begin_min);
        begins.filter(|begin_min| *begin_min > 0.0).map(|begin_min| begin_min - self.step_min / 2.0).collect()
    }

    /// Where the recordings begin [min], in the order of the pipeline.
    pub fn begins(&self) -> Column {
        Column::of(self.begins.iter().map(|begin| begin.map(|(_, begin_min)| begin_min)))
    }
}

fn ns_to_min(ns: i64) -> f64 {
    ns as f64 / 60e9
}

#[cfg(test)]
mod tests {
    use super::*;
    use armcal_core::{DwellId, Reference};
    use nalgebra::Vector3;

    #[test]
    fn days_between_recordings_take_one_step() {
        let minute_ns = 60_000_000_000_i64;
        // The second recording was made a day before the first, the third was not made.
        let of = |recording: usize, start_min: i64| {
            (0..4).map(move |k| Observation {
                time_ns: (start_min + 2 * k) * minute_ns,
                ..Observation::bare(
                    DwellId { recording, dwell: k as usize },
                    Vec::new(),
                    Reference::position(Vector3::zeros()),
                )
            })
        };
        let all: Vec<Observation> = of(0, 1440).chain(of(1, 0)).collect();
        let time = RecordedTime::of(&all, 3);
        assert_eq!(time.begins().0, [Some(8.0), Some(0.0), None]);
        let at: Vec<f64> = all.iter().map(|o| time.at_min(o)).collect();
        assert_eq!(at, [8.0, 10.0, 12.0, 14.0, 0.0, 2.0, 4.0, 6.0]);
        assert_eq!(time.cuts(), [7.0]);
        assert_eq!(RecordedTime::of(&all[..1], 1).at_min(&all[0]), 0.0);
    }
}
