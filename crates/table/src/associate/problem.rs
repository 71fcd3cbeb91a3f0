//! The data of one association: tips that can be used, how much each counts, and the priors in SI units.

use super::field::Prior;
use super::layout::Layout;
use super::{BoardStart, DwellTip};
use crate::{AssociationConfig, Board};
use armcal_core::robust::median;
use nalgebra::{DMatrix, Matrix4x3, Vector3, Vector4};

/// Tips closer together than this are one place visited again [m].
const SITE_M: f64 = 0.005;

pub(super) struct Problem<'a> {
    pub layout: Layout,
    pub config: &'a AssociationConfig,
    /// Position of each usable dwell's tip in the world, in the order of time given.
    pub tips_m: Vec<Vector3<f64>>,
    /// Index of each usable dwell in the input.
    pub index: Vec<usize>,
    /// How much each counts in comparing explanations: repeats of one place share its error, so `n` of
    /// them count as `sqrt(n)`.
    pub weight: Vec<f64>,
    /// Scatter of a tip beyond that of the others, per axis: the sensor missed it [m].
    pub extra_sigma_m: Vec<f64>,
    pub sites: Vec<Site>,
    /// The weight of all of them.
    pub sites_weight: f64,
    /// Probability that a dwell is in the cavity of the one before it, as a first guess.
    pub stay: f64,
    /// Cavities in the configured order of visits, as indices into the layout.
    pub order: Option<Vec<usize>>,
    /// Whether the board's pose is to be found from the dwells alone.
    pub free_pose: bool,
    pub prior: Prior,
}

/// A place the tip was in, once or several times.
pub(super) struct Site {
    pub at_m: Vector3<f64>,
    pub weight: f64,
}

impl<'a> Problem<'a> {
    pub fn new(
        board: &Board,
        tips: &[DwellTip],
        start: &BoardStart,
        config: &'a AssociationConfig,
    ) -> Problem<'a> {
        let positions = tip_positions(tips, config.use_measured);
        let (positions_m, measured) = (&positions.at_m, positions.measured);
        let finite = |p: &Vector3<f64>| p.iter().all(|v| v.is_finite());
        let index: Vec<usize> = (0..tips.len()).filter(|&i| finite(&positions_m[i])).collect();
        let tips_m: Vec<Vector3<f64>> = index.iter().map(|&i| positions_m[i]).collect();
        let layout = Layout::new(board);
        let (sites, site_of) = group_sites(&tips_m);
        let weight = site_of.iter().map(|&s| 1.0 / sites[s].weight).collect();
        let free_pose = matches!(start, BoardStart::Unknown);
        let turn = config.rotation_sigma_deg.to_radians();
        let offset_mm = if measured { config.marker_offset_sigma_mm } else { config.offset_sigma_mm };
        Problem {
            stay: stay_probability(&tips_m, 0.5 * layout.spacing_m),
            order: config
                .visiting_order
                .as_ref()
                .map(|names| names.iter().filter_map(|n| layout.names.iter().position(|l| l == n)).collect()),
            prior: Prior {
                // A free pose takes offset and turn; the field is what is left.
                offset_m: if free_pose { 0.3 * layout.spacing_m } else { offset_mm * 1e-3 },
                slope: if free_pose { config.shear_sigma } else { turn.hypot(config.shear_sigma) },
                curvature_per_m: config.curvature_sigma_per_m,
            },
            layout,
            config,
            extra_sigma_m: index.iter().map(|&i| positions.extra_sigma_m[i]).collect(),
            tips_m,
            index,
            weight,
            sites_weight: sites.iter().map(|s| s.weight).sum(),
            sites,
            free_pose,
        }
    }

    /// The largest scatter per axis with which tips can still be told apart.
    pub fn sigma_cap_m(&self) -> f64 {
        0.3 * self.layout.spacing_m
    }

    /// Middle of the sites in a frame, axis by axis the median.
    pub fn middle_m(&self, frame_from_world: &armcal_core::Pose) -> Vector3<f64> {
        let points: Vec<_> =
            self.sites.iter().map(|s| frame_from_world.transform_point(&s.at_m.into()).coords).collect();
        Vector3::from_fn(|axis, _| median(&points.iter().map(|p| p[axis]).collect::<Vec<f64>>()))
    }
}

/// Where the tips are.
struct Positions {
    at_m: Vec<Vector3<f64>>,
    extra_sigma_m: Vec<f64>,
    /// Whether the sensor was used.
    measured: bool,
}

/// The tip of every dwell, by the sensor where most dwells have it; a dwell the sensor missed is placed by
/// an affine map from prediction to measurement, fitted to the others, and is as uncertain as that map.
fn tip_positions(tips: &[DwellTip], use_measured: bool) -> Positions {
    let predicted = || Positions {
        at_m: tips.iter().map(|t| t.predicted_m).collect(),
        extra_sigma_m: vec![0.0; tips.len()],
        measured: false,
    };
    let finite = |v: &Vector3<f64>| v.iter().all(|x| x.is_finite());
    let pairs: Vec<(Vector3<f64>, Vector3<f64>)> = tips
        .iter()
        .filter_map(|t| Some((t.predicted_m, t.measured_m?)))
        .filter(|(p, m)| finite(p) && finite(m))
        .collect();
    if !use_measured || pairs.len() * 2 < tips.len() || pairs.len() < 4 {
        return predicted();
    }
    let n = pairs.len() as f64;
    let centre = pairs.iter().map(|(p, _)| p).sum::<Vector3<f64>>() / n;
    let row = |p: &Vector3<f64>| Vector4::new(1.0, p.x - centre.x, p.y - centre.y, p.z - centre.z);
    let design = DMatrix::from_fn(pairs.len(), 4, |i, j| row(&pairs[i].0)[j]);
    let target = DMatrix::from_fn(pairs.len(), 3, |i, j| pairs[i].1[j] - pairs[i].0[j]);
    let Ok(solved) = design.svd(true, true).solve(&target, 1e-6) else { return predicted() };
    let map = Matrix4x3::from_fn(|i, j| solved[(i, j)]);
    let mapped = |p: &Vector3<f64>| p + map.transpose() * row(p);
    let squares: f64 = pairs.iter().map(|(p, m)| (mapped(p) - m).norm_squared()).sum();
    let missed_sigma_m = (squares / (3.0 * n)).sqrt();
    let seen = |t: &DwellTip| t.measured_m.filter(finite);
    Positions {
        at_m: tips.iter().map(|t| seen(t).unwrap_or_else(|| mapped(&t.predicted_m))).collect(),
        extra_sigma_m: tips.iter().map(|t| if seen(t).is_some() { 0.0 } else { missed_sigma_m }).collect(),
        measured: true,
    }
}

/// Groups tips into places; returns them and the place of each tip.
fn group_sites(tips_m: &[Vector3<f64>]) -> (Vec<Site>, Vec<usize>) {
    let mut first: Vec<Vector3<f64>> = Vec::new();
    let mut sum: Vec<(Vector3<f64>, f64)> = Vec::new();
    let mut site_of = Vec::with_capacity(tips_m.len());
    for tip in tips_m {
        let site = first.iter().position(|f| (f - tip).norm_squared() < SITE_M * SITE_M);
        let site = site.unwrap_or_else(|| {
            first.push(*tip);
            sum.push((Vector3::zeros(), 0.0));
            first.len() - 1
        });
        sum[site].0 += tip;
        sum[site].1 += 1.0;
        site_of.push(site);
    }
    let sites = sum.iter().map(|(s, n)| Site { at_m: s / *n, weight: n.sqrt() }).collect();
    (sites, site_of)
}

fn stay_probability(tips_m: &[Vector3<f64>], near_m: f64) -> f64 {
    let moves = tips_m.len().saturating_sub(1) as f64;
    let stays = tips_m.windows(2).filter(|w| (w[1] - w[0]).norm() < near_m).count() as f64;
    ((stays + 1.0) / (moves + 3.0)).clamp(0.05, 0.95)
}
