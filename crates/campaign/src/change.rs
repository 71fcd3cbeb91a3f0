//! Steps, outliers and trends of a campaign's quantities, with their sizes.

use crate::line::{Line, Mean, Weighed, bonferroni_t95, has_scatter, p_value, residual_scale, weigh_points};
use crate::segment::{Best, Shape, best_shape};
use crate::{Series, SeriesPoint};
use armcal_core::Unit;
use serde::Serialize;

/// Probability that a campaign in which nothing changes shows any change at all.
const FALSE_ALARMS: f64 = 0.01;

/// A change of one quantity.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Change {
    /// Which quantity.
    pub quantity: String,
    /// Its unit (of a trend: a day of it).
    pub unit: Unit,
    /// What it does.
    #[serde(flatten)]
    pub kind: ChangeKind,
    /// By how much: after minus before, outlier minus the others, or per day.
    pub size: f64,
    /// 95 % interval of the size, with the same correction as `p`; `null` where the recordings do not say how much they
    /// scatter: too few beside it, or all alike.
    pub ci95: Option<[f64; 2]>,
    /// Probability of such a change by chance, corrected for the points and quantities that were looked at.
    pub p: f64,
}

/// How a quantity changes; recordings are named by their rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum ChangeKind {
    /// Between two recordings, and it stays.
    Step {
        /// The last recording before.
        before: usize,
        /// The first after.
        after: usize,
    },
    /// In one recording alone.
    Outlier {
        /// Which.
        at: usize,
    },
    /// Steadily.
    Trend {
        /// From this recording.
        from: usize,
        /// To this one.
        to: usize,
    },
}

/// Every change of these series that chance would give with less than one percent in all of them together; by time,
/// the surest of one moment first.
pub fn find_changes(all: &[Series]) -> Vec<Change> {
    let alpha = FALSE_ALARMS / all.len().max(1) as f64;
    let of_one = |series: &Series| {
        let mut found = Found::default();
        found.search(weigh_points(&series.points), true, alpha);
        found.prune(alpha);
        let changes = found.changes(series, all.len() as f64);
        changes.into_iter().map(|c| (time_ns(series, &c), c)).collect::<Vec<_>>()
    };
    let mut found: Vec<(i64, Change)> = all.iter().flat_map(of_one).collect();
    found.sort_by(|(at, a), (bt, b)| at.cmp(bt).then(a.p.total_cmp(&b.p)));
    found.into_iter().map(|(_, change)| change).collect()
}

/// When a change shows first.
fn time_ns(series: &Series, change: &Change) -> i64 {
    let (ChangeKind::Step { after: row, .. }
    | ChangeKind::Outlier { at: row }
    | ChangeKind::Trend { from: row, .. }) = change.kind;
    series.points.iter().find(|p| p.row == row).map_or(i64::MAX, |p| p.time_ns)
}

/// A series taken apart: stretches in which nothing happens, and what happens between and in them.
#[derive(Default)]
struct Found {
    stretches: Vec<Vec<Weighed>>,
    /// First point after each step.
    steps: Vec<(SeriesPoint, Chance)>,
    outliers: Vec<(Weighed, Chance)>,
    trends: Vec<(Line, [SeriesPoint; 2], Vec<Weighed>, Chance)>,
}

/// How probable a shape is by chance, and in how many places it was looked for.
#[derive(Debug, Clone, Copy)]
struct Chance {
    p: f64,
    tries: usize,
}

/// How well a size is known.
struct Known {
    sigma: f64,
    freedom: usize,
    /// Whether the recordings' scatter says so.
    scatters: bool,
}

impl Known {
    /// By the scatter of `points`, whose weighted squares these are; `unit` is the standard error for unit scatter.
    fn by<'a>(
        mut points: impl Iterator<Item = &'a Weighed>,
        unit: f64,
        squares: f64,
        freedom: usize,
    ) -> Known {
        let rounding = points.any(|p| p.finest_is_rounding);
        let scatters = freedom > 0 && (has_scatter(squares, freedom) || !rounding);
        Known { sigma: unit * residual_scale(squares, freedom), freedom, scatters }
    }
}

impl Found {
    /// Binary segmentation (Vostrikova 1981): the best change first, then what is left on both sides of it. `alpha` is
    /// what may be spent on this stretch; its parts share it by their lengths.
    fn search(&mut self, mut points: Vec<Weighed>, trends: bool, alpha: f64) {
        let n = points.len() as f64;
        let share = |part: &[Weighed]| alpha * part.len() as f64 / n;
        let Some(Best { shape, p, tries }) = best_shape(&points, trends, alpha) else {
            return self.stretches.push(points);
        };
        let p = Chance { p, tries };
        match shape {
            Shape::Step(k) => {
                self.steps.push((points[k].at, p));
                let after = points.split_off(k);
                for part in [points, after] {
                    let alpha = share(&part);
                    self.search(part, trends, alpha);
                }
            }
            Shape::Episode(i, j) => {
                self.steps.extend([(points[i].at, p), (points[j].at, p)]);
                let after = points.split_off(j);
                let during = points.split_off(i);
                for part in [points, during, after] {
                    let alpha = share(&part);
                    self.search(part, trends, alpha);
                }
            }
            Shape::Outlier(k) => {
                self.outliers.push((points.remove(k), p));
                self.search(points, trends, alpha);
            }
            Shape::Trend => {
                let ends = [points[0].at, points[points.len() - 1].at];
                if let Some(line) = Line::through(&points) {
                    self.trends.push((line, ends, points.clone(), p));
                    points.iter_mut().for_each(|point| point.value -= line.at(point.day));
                }
                self.search(points, false, alpha);
            }
        }
    }

    /// Takes back every step that does not stand by itself: the far end of an episode may be no more than scatter.
    fn prune(&mut self, alpha: f64) {
        self.stretches.sort_by_key(|s| s.first().map(|p| (p.at.time_ns, p.at.row)));
        loop {
            let p = |k: &usize| Between::of(&self.stretches[*k - 1], &self.stretches[*k]).p();
            let weakest = (1..self.stretches.len()).max_by(|a, b| p(a).total_cmp(&p(b)));
            let Some(k) = weakest.filter(|k| p(k) >= alpha) else { return };
            let first = self.stretches[k].first().map(|w| w.at);
            self.steps.retain(|(at, _)| Some(*at) != first);
            let after = self.stretches.remove(k);
            self.stretches[k - 1].extend(after);
        }
    }

    /// What was found, each with its interval; `series_tried` is how many series were looked at.
    fn changes(&self, series: &Series, series_tried: f64) -> Vec<Change> {
        let change = |kind, size: f64, known: Known, chance: Chance| {
            let half = known.sigma * bonferroni_t95(known.freedom, chance.tries as f64 * series_tried);
            Change {
                quantity: series.quantity.clone(),
                unit: series.unit,
                kind,
                size,
                ci95: known.scatters.then_some([size - half, size + half]),
                p: (chance.p * series_tried).min(1.0),
            }
        };
        let steps = self.steps.iter().filter_map(|(first, chance)| {
            let at = self.stretches.iter().position(|s| s.first().is_some_and(|w| w.at == *first))?;
            let (before, after) = (self.stretches.get(at.checked_sub(1)?)?, &self.stretches[at]);
            let between = Between::of(before, after);
            let kind = ChangeKind::Step { before: before.last()?.at.row, after: first.row };
            Some(change(kind, between.size, between.known, *chance))
        });
        let outliers = self.outliers.iter().filter_map(|(point, chance)| {
            let around = |s: &&Vec<Weighed>| {
                let ends = s.first().zip(s.last());
                ends.is_some_and(|(a, b)| (a.at.time_ns..=b.at.time_ns).contains(&point.at.time_ns))
            };
            let others = self.stretches.iter().find(around)?;
            let (mean, freedom) = (Mean::of(others), others.len() - 1);
            let unit = (1.0 / mean.weight + 1.0 / point.weight).sqrt();
            let known = Known::by(others.iter(), unit, mean.squares, freedom);
            Some(change(ChangeKind::Outlier { at: point.at.row }, point.value - mean.value, known, *chance))
        });
        let trends = self.trends.iter().map(|(line, [from, to], points, chance)| {
            let known = Known::by(points.iter(), line.sigma_per_day, line.squares, points.len() - 2);
            change(ChangeKind::Trend { from: from.row, to: to.row }, line.per_day, known, *chance)
        });
        steps.chain(outliers).chain(trends).collect()
    }
}

/// What lies between two stretches.
struct Between {
    size: f64,
    known: Known,
}

impl Between {
    fn of(before: &[Weighed], after: &[Weighed]) -> Between {
        let (m, n) = (Mean::of(before), Mean::of(after));
        let freedom = (before.len() + after.len()).saturating_sub(2);
        let unit = (1.0 / m.weight + 1.0 / n.weight).sqrt();
        let known = Known::by(before.iter().chain(after), unit, m.squares + n.squares, freedom);
        Between { size: n.value - m.value, known }
    }

    /// Probability by chance of a step at this very place.
    fn p(&self) -> f64 {
        let Known { sigma, freedom, .. } = self.known;
        if freedom == 0 { 1.0 } else { p_value(self.size / sigma, freedom) }
    }
}
