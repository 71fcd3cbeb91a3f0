//! The best single explanation of a stretch: nothing, a step, one outlier, an episode, or a trend.

use crate::line::{Line, Mean, Weighed, p_value, residual_scale};

/// Shortest stretch that is judged: below, every scatter is possible.
const SHORTEST: usize = 4;

/// What a stretch shows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Shape {
    /// Means differ before and from this point on.
    Step(usize),
    /// This point alone is off.
    Outlier(usize),
    /// From the first point up to, not including, the second one the mean is another.
    Episode(usize, usize),
    /// It rises or falls.
    Trend,
}

/// A shape that a stretch shows.
pub(crate) struct Best {
    pub shape: Shape,
    /// Probability by chance, corrected for every place at which this shape was tried.
    pub p: f64,
    /// How many places these were.
    pub tries: usize,
}

struct Candidate {
    found: Best,
    squares: f64,
    /// Free numbers of this explanation.
    numbers: f64,
}

/// The most plausible shape that chance gives with less than `alpha`.
///
/// Shapes that pass are compared by the Bayesian information criterion (Schwarz 1978). Steps, outliers and episodes are tried
/// everywhere, which Bonferroni's inequality pays for.
pub(crate) fn best_shape(points: &[Weighed], trends: bool, alpha: f64) -> Option<Best> {
    let n = points.len();
    if n < SHORTEST {
        return None;
    }
    let trend = if trends { trend_candidate(points) } else { None };
    let candidates = [step_candidate(points), outlier_candidate(points), episode_candidate(points), trend];
    let criterion = |c: &Candidate| {
        n as f64 * (c.squares / n as f64).max(f64::MIN_POSITIVE).ln() + c.numbers * (n as f64).ln()
    };
    let passing = candidates.into_iter().flatten().filter(|c| c.found.p < alpha);
    passing.min_by(|a, b| criterion(a).total_cmp(&criterion(b))).map(|c| c.found)
}

/// The split with the largest two-sample t.
fn step_candidate(points: &[Weighed]) -> Option<Candidate> {
    let n = points.len();
    let [upto, from] = partial_means(points);
    let split = |k: usize| (Shape::Step(k), upto[k], from[k]);
    largest_t_candidate((1..n).map(split), n - 1, n - 2, 3.0)
}

/// The inner point that is furthest from all others; the ends are steps of which one side is short.
fn outlier_candidate(points: &[Weighed]) -> Option<Candidate> {
    let n = points.len();
    let [upto, from] = partial_means(points);
    let alone = |k: usize| (Shape::Outlier(k), upto[k].with(from[k + 1]), Mean::of(&points[k..=k]));
    largest_t_candidate((1..n - 1).map(alone), n - 2, n - 2, 3.0)
}

/// The inner stretch whose mean differs most from that of all others (circular binary segmentation, Olshen et al.
/// 2004, Biostatistics 5:557): what is bumped and put right again hides from a single step.
fn episode_candidate(points: &[Weighed]) -> Option<Candidate> {
    let n = points.len();
    let [upto, from] = partial_means(points);
    let during = |i: usize| {
        let grow = move |inner: &mut Mean, j: usize| {
            *inner = inner.with(Mean::of(&points[j - 1..j]));
            Some((j, *inner))
        };
        (i + 1..n)
            .scan(Mean::default(), grow)
            .filter(move |(j, _)| j - i > 1)
            .map(move |(j, inner)| (i, j, inner))
    };
    let judged = (1..n - 1).flat_map(during);
    let judged = judged.map(|(i, j, inner)| (Shape::Episode(i, j), upto[i].with(from[j]), inner));
    largest_t_candidate(judged, n * n / 2, n - 2, 4.0)
}

/// Means of the points before each place, and from it on.
fn partial_means(points: &[Weighed]) -> [Vec<Mean>; 2] {
    let one = |p: &Weighed| Mean::of(std::slice::from_ref(p));
    let (mut upto, mut from) = (vec![Mean::default()], vec![Mean::default()]);
    for point in points {
        upto.push(upto[upto.len() - 1].with(one(point)));
    }
    for point in points.iter().rev() {
        from.push(one(point).with(from[from.len() - 1]));
    }
    from.reverse();
    [upto, from]
}

/// The candidate with the largest t between its two groups.
fn largest_t_candidate(
    judged: impl Iterator<Item = (Shape, Mean, Mean)>,
    tries: usize,
    freedom: usize,
    numbers: f64,
) -> Option<Candidate> {
    let with_t =
        judged.map(|(shape, one, other)| (shape, one.t_of(&other, freedom), one.squares + other.squares));
    let (shape, t, squares) = with_t.max_by(|(_, a, _), (_, b, _)| a.abs().total_cmp(&b.abs()))?;
    let p = (tries as f64 * p_value(t, freedom)).min(1.0);
    Some(Candidate { found: Best { shape, p, tries }, squares, numbers })
}

fn trend_candidate(points: &[Weighed]) -> Option<Candidate> {
    let n = points.len();
    let line = Line::through(points)?;
    let t = line.per_day / (line.sigma_per_day * residual_scale(line.squares, n - 2));
    let found = Best { shape: Shape::Trend, p: p_value(t, n - 2), tries: 1 };
    Some(Candidate { found, squares: line.squares, numbers: 2.0 })
}
