//! A small arm of its own kinematics (three joints, the paper's dimensions), with effects planted as displacements of
//! the very physics, columns by central differences. Shares no code with the crates under test.

#![allow(dead_code, unused_imports)]

mod effects;

pub use effects::{Effect, Listed, catalogue, on_joint, outside, torque};

use armcal_core::{DwellId, FeatureId, Unit};
use armcal_diagnose::{
    Amplitude, Candidate, Channel, Columns, DiagnoseError, DwellRow, Part, Problem, Refit, Scan, Toggle,
};
use nalgebra::{DMatrix, DVector, Matrix3, Matrix3xX, Matrix4, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal, StudentT};
use std::sync::Arc;

/// Noise of a coordinate [m].
pub const SIGMA_M: f64 = 0.28e-3;

/// What the arm is, beyond rigid and nominal.
#[derive(Debug, Clone, Default)]
pub struct State {
    /// 12 DH errors (theta, d, a, alpha of each link), 3 tool, 6 base.
    pub geometry: Vec<f64>,
}

/// One dwell of a design.
#[derive(Debug, Clone)]
pub struct Pose {
    pub q: [f64; 3],
    pub s: [f64; 3],
    pub recording: usize,
    pub dwell: usize,
    pub time: f64,
    pub load: f64,
    pub place: Option<String>,
}

fn dh(theta: f64, d: f64, a: f64, alpha: f64) -> Matrix4<f64> {
    let (st, ct) = theta.sin_cos();
    let (sa, ca) = alpha.sin_cos();
    Matrix4::new(
        ct,
        -st * ca,
        st * sa,
        a * ct,
        st,
        ct * ca,
        -ct * sa,
        a * st,
        0.0,
        sa,
        ca,
        d,
        0.0,
        0.0,
        0.0,
        1.0,
    )
}

/// Tip in the world for geometry errors `g` (21).
pub fn fk(q: [f64; 3], g: &[f64]) -> Vector3<f64> {
    let h = std::f64::consts::FRAC_PI_2;
    let links = [(0.0, 0.076, 0.0, h), (h, 0.0, 0.4, 0.0), (0.0, -0.012, 0.0, h)];
    let mut t = Matrix4::identity();
    for (k, (theta, d, a, alpha)) in links.into_iter().enumerate() {
        let e = &g[4 * k..4 * k + 4];
        t *= dh(q[k] + theta + e[0], d + e[1], a + e[2], alpha + e[3]);
    }
    let tip = t * nalgebra::Vector4::new(g[12], g[13], 0.3543 + g[14], 1.0);
    let w = Vector3::new(g[18], g[19], g[20]);
    let p = tip.xyz();
    p + Vector3::new(g[15], g[16], g[17]) + w.cross(&p)
}

pub const GEOMETRY: usize = 21;

fn geometry_sd(k: usize) -> f64 {
    match k {
        15..18 => 0.02,
        18.. => 4f64.to_radians(),
        12..15 => 0.004,
        _ if matches!(k % 4, 0 | 3) => 1.6f64.to_radians(),
        _ => 0.004,
    }
}

/// Joint angles that reach a point, by Newton from a start.
fn inverse(target: Vector3<f64>, start: [f64; 3]) -> [f64; 3] {
    let zero = [0.0; GEOMETRY];
    let mut q = start;
    for _ in 0..60 {
        let e = target - fk(q, &zero);
        let mut j = Matrix3::zeros();
        for k in 0..3 {
            let mut up = q;
            up[k] += 1e-6;
            j.set_column(k, &((fk(up, &zero) - fk(q, &zero)) / 1e-6));
        }
        let step =
            (j.transpose() * j + Matrix3::identity() * 1e-6).try_inverse().unwrap() * j.transpose() * e;
        (0..3).for_each(|k| q[k] += step[k].clamp(-0.2, 0.2));
    }
    q
}

/// Three tilts, every cavity forward and backward: 198 dwells; `free` adds as many tracked free poses.
pub fn design(free: usize, rng: &mut ChaCha8Rng) -> Vec<Pose> {
    let mut cavities = Vec::new();
    for k in 0..20 {
        let a = std::f64::consts::TAU * k as f64 / 20.0;
        cavities.push(Vector3::new(0.1 * a.cos(), 0.1 * a.sin(), 0.0));
    }
    for k in 0..13 {
        cavities.push(Vector3::new(0.13, -0.13 + 0.26 * k as f64 / 12.0, 0.0));
    }
    let mut poses: Vec<Pose> = Vec::new();
    let mut time = 0.0;
    for (recording, tilt) in [(0.0, 0.0), (11.7f64, 0.0), (0.0, 11.8f64)].into_iter().enumerate() {
        let r = nalgebra::Rotation3::from_euler_angles(tilt.0.to_radians(), tilt.1.to_radians(), 0.0);
        let points: Vec<Vector3<f64>> =
            cavities.iter().map(|c| Vector3::new(0.42, 0.0, 0.10) + r * c).collect();
        let mut order: Vec<usize> = (0..33).collect();
        order.extend((0..33).rev());
        let mut last: Option<[f64; 3]> = None;
        for (dwell, c) in order.into_iter().enumerate() {
            let q = inverse(points[c], last.unwrap_or([0.0, -0.3, -0.2]));
            let from = last.unwrap_or([q[0] - 0.1, q[1] - 0.1, q[2] + 0.1]);
            let sign = |k: usize| if q[k] > from[k] { 1.0 } else { -1.0 };
            // At the turn the arm leaves and comes back the other way.
            let turned = dwell == 33;
            let s =
                std::array::from_fn(|k| if turned { -poses.last().map_or(1.0, |p| p.s[k]) } else { sign(k) });
            time += 10.0 + 2.0 * rng.random::<f64>();
            let q = std::array::from_fn(|k| q[k] + 0.002 * (rng.random::<f64>() - 0.5));
            poses.push(Pose { q, s, recording, dwell, time, load: 0.0, place: Some(format!("c{c:02}")) });
            last = Some(q);
        }
    }
    let mut last = [0.0; 3];
    for dwell in 0..free {
        let q = [
            (rng.random::<f64>() * 2.0 - 1.0) * 1.05,
            -1.3 + rng.random::<f64>() * 1.65,
            -1.05 + rng.random::<f64>() * 1.92,
        ];
        time += 12.0;
        let s = std::array::from_fn(|k| if q[k] > last[k] { 1.0 } else { -1.0 });
        poses.push(Pose { q, s, recording: 3, dwell, time, load: 0.0, place: None });
        last = q;
    }
    poses
}

/// Kinds of noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Noise {
    White,
    StudentT3,
    Ar1,
    Seat,
    Swaps,
}

/// Catalogue entries planted at `size` times their typical size, and white noise.
pub fn planted(names: &[(&str, f64)], free: usize, seed: u64) -> Problem {
    let mut r = rng(seed);
    let poses = design(free, &mut r);
    let list = catalogue(&poses);
    let of = |(name, size): &(&str, f64)| {
        let own = list.iter().find(|l| l.spec == *name).expect("a name of the catalogue");
        (own.effect.clone(), own.typical.iter().map(|t| size * t).collect())
    };
    let hidden: Vec<_> = names.iter().map(of).collect();
    problem(&poses, &hidden, Noise::White, &mut r, false)
}

/// A problem with planted displacements [m] (already at size), noise and geometry errors.
pub fn problem(
    poses: &[Pose],
    planted: &[(Effect, Vec<f64>)],
    noise: Noise,
    rng: &mut ChaCha8Rng,
    periodic: bool,
) -> Problem {
    let n = poses.len();
    let span = poses.iter().map(|p| p.time).fold(1.0, f64::max);
    let dwells: Vec<DwellRow> = poses
        .iter()
        .enumerate()
        .map(|(i, p)| DwellRow {
            id: DwellId { recording: p.recording, dwell: p.dwell },
            first_row: 3 * i,
            rows: 3,
            parts: vec![Part {
                what: (FeatureId::TIP, None),
                rows: 3,
                tracked: p.place.is_none(),
                metres: Matrix3xX::identity(3) * SIGMA_M,
            }],
            time_s: p.time,
            joint_rad: p.q.to_vec(),
            arrival: p.s.to_vec(),
            torque_nm: torque(p.q).to_vec(),
            load_kg: p.load,
            temperature_c: Option::None,
            place: p.place.clone(),
            displaced: DMatrix::identity(3, 3) / SIGMA_M,
            seat: DMatrix::identity(3, 3),
        })
        .collect();
    let columns = |m: usize, f: &dyn Fn(&Pose, usize) -> Vector3<f64>| {
        let mut c = DMatrix::zeros(3 * n, m);
        for (i, p) in poses.iter().enumerate() {
            for k in 0..m {
                c.view_mut((3 * i, k), (3, 1)).copy_from(&(f(p, k) / SIGMA_M));
            }
        }
        c
    };
    let zero = vec![0.0; GEOMETRY];
    let geometry = columns(GEOMETRY, &|p, k| {
        let (mut up, mut down) = (zero.clone(), zero.clone());
        (up[k], down[k]) = (1e-5, -1e-5);
        (fk(p.q, &up) - fk(p.q, &down)) / 2e-5 * geometry_sd(k)
    });
    let amplitude = |l: &Listed| {
        l.typical
            .iter()
            .enumerate()
            .map(|(k, t)| Amplitude {
                name: format!("a{k}"),
                unit: l.unit,
                typical: *t,
                never_negative: false,
            })
            .collect()
    };
    let effect_columns = |effect: &Effect, typical: &[f64]| {
        columns(typical.len(), &|p, k| {
            let mut a = vec![0.0; typical.len()];
            a[k] = 1e-3 * typical[k];
            let up = effect(p, &a, span);
            a[k] = -1e-3 * typical[k];
            (up - effect(p, &a, span)) / 2e-3
        })
    };
    let candidates = catalogue(poses)
        .iter()
        .map(|l| Candidate {
            spec: l.spec.clone(),
            family: l.family.to_string(),
            target: l.spec.split_once(':').map_or(String::new(), |t| format!("joint{}", &t.1[..1])),
            aliases: Vec::new(),
            known: Option::None,
            amplitudes: amplitude(l),
            per_turn: Option::None,
            toggle: l.toggle,
            columns: Columns::Dense(Arc::new(effect_columns(&l.effect, &l.typical))),
        })
        .collect();
    let joint: Vec<Arc<DMatrix<f64>>> =
        (0..3).map(|j| Arc::new(effect_columns(&on_joint(j, |_, a, _| a[0]), &[0.01]) / 0.01)).collect();
    let scans =
        if periodic { (0..3).map(|j| periodic_scan(poses, j, &joint[j])).collect() } else { Vec::new() };
    let mut residual = DVector::from_fn(3 * n, |_, _| 0.0);
    let delta = DVector::from_fn(GEOMETRY, |_, _| {
        let z: f64 = StandardNormal.sample(rng);
        0.8 * z
    });
    residual += &geometry * delta;
    for (i, p) in poses.iter().enumerate() {
        let mut d: Vector3<f64> = planted.iter().map(|(e, a)| e(p, a, span)).sum();
        if noise == Noise::Swaps && rng.random::<f64>() < 0.03 {
            let v = Vector3::from_fn(|_, _| {
                let z: f64 = StandardNormal.sample(rng);
                z
            });
            d += v.normalize() * (0.003 + 0.005 * rng.random::<f64>());
        }
        let mut rows = residual.rows_mut(3 * i, 3);
        rows += d / SIGMA_M;
    }
    add_noise(&mut residual, poses, noise, rng);
    Problem {
        dwells,
        residual,
        geometry_offset: DVector::zeros(GEOMETRY),
        geometry_precision: DVector::from_element(GEOMETRY, 1.0),
        geometry,
        candidates,
        scans,
        channels: channels(&joint, &columns),
    }
}

fn periodic_scan(poses: &[Pose], j: usize, joint: &Arc<DMatrix<f64>>) -> Scan {
    let size = 0.15f64.to_radians();
    let points = (4..=80).map(|f| {
        let nu = f64::from(f);
        let basis = DMatrix::from_fn(poses.len(), 2, |i, k| {
            let angle = nu * poses[i].q[j];
            size * if k == 0 { angle.sin() } else { angle.cos() }
        });
        Candidate {
            spec: format!("periodic:{},frequency={nu}", j + 1),
            family: "periodic".into(),
            target: format!("joint{}", j + 1),
            aliases: Vec::new(),
            known: Option::None,
            amplitudes: (0..2)
                .map(|k| Amplitude {
                    name: format!("a{k}"),
                    unit: Unit::Radian,
                    typical: size,
                    never_negative: false,
                })
                .collect(),
            per_turn: Some(nu),
            toggle: Toggle::None,
            columns: Columns::Product { base: joint.clone(), basis: Arc::new(basis), size: 1.0 },
        }
    });
    Scan::of(format!("periodic:{}", j + 1), points.collect())
}

type Make<'a> = dyn Fn(usize, &dyn Fn(&Pose, usize) -> Vector3<f64>) -> DMatrix<f64> + 'a;

fn channels(joint: &[Arc<DMatrix<f64>>], columns: &Make<'_>) -> Vec<Channel> {
    let mut all = Vec::new();
    let mut add = |name: &str, unit, axes: &[&str], columns: Arc<DMatrix<f64>>| {
        all.push(Channel {
            enters: name.to_owned().into(),
            unit,
            axes: axes.iter().map(|a| a.to_string()).collect(),
            columns,
        });
    };
    for (j, c) in joint.iter().enumerate() {
        let name = format!("joint{}", j + 1);
        add(&name, Unit::Radian, &[&name], c.clone());
    }
    add("joint2 with the forearm's direction kept", Unit::Radian, &[], Arc::new(&*joint[1] - &*joint[2]));
    let length = |index: usize| {
        Arc::new(columns(1, &|p, _| {
            let mut g = [0.0; GEOMETRY];
            g[index] = 1e-4;
            (fk(p.q, &g) - fk(p.q, &[0.0; GEOMETRY])) / 1e-4
        }))
    };
    add("link 2 length", Unit::Metre, &["link2.a"], length(6));
    add("link 3 length", Unit::Metre, &["tip.z"], length(14));
    let axis = |k: usize| Vector3::from_fn(|r, _| f64::from(u8::from(r == k)));
    let tilt = columns(2, &|p, k| axis(k).cross(&fk(p.q, &[0.0; GEOMETRY])));
    add("tilt", Unit::Radian, &["base.rx", "base.ry"], Arc::new(tilt));
    add("shift", Unit::Metre, &["tip x", "tip y", "tip z"], Arc::new(columns(3, &|_, k| axis(k))));
    all
}

fn add_noise(residual: &mut DVector<f64>, poses: &[Pose], noise: Noise, rng: &mut ChaCha8Rng) {
    let n = poses.len();
    let normal = |rng: &mut ChaCha8Rng| -> f64 { StandardNormal.sample(rng) };
    let t3 = StudentT::new(3.0).unwrap();
    let mut seats: std::collections::BTreeMap<String, Vector3<f64>> = Default::default();
    let mut state = Vector3::from_fn(|_, _| normal(rng));
    for i in 0..n {
        for k in 0..3 {
            residual[3 * i + k] += match noise {
                Noise::StudentT3 => t3.sample(rng) / 3f64.sqrt(),
                Noise::Ar1 => {
                    state[k] = 0.7 * state[k] + (1.0f64 - 0.49).sqrt() * normal(rng);
                    state[k]
                }
                Noise::Seat => {
                    let key = poses[i].place.clone().unwrap_or(format!("free{i}"));
                    let seat = *seats.entry(key).or_insert_with(|| Vector3::from_fn(|_, _| normal(rng)));
                    0.5f64.sqrt() * (seat[k] + normal(rng))
                }
                _ => normal(rng),
            };
        }
    }
}

pub fn rng(seed: u64) -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(seed)
}

fn scale(columns: &mut Columns, factor: f64) {
    match columns {
        Columns::Dense(m) => *m = Arc::new(m.as_ref() * factor),
        Columns::Product { size, .. } => *size *= factor,
        Columns::Wave { sizes, .. } => sizes.iter_mut().for_each(|size| *size *= factor),
        Columns::Within { base, .. } => *base = Arc::new(base.as_ref() * factor),
        Columns::Together(parts) => parts.iter_mut().for_each(|part| scale(part, factor)),
    }
}

/// The same problem with the noise declared `factor` times too small.
pub fn overconfident(mut p: Problem, factor: f64) -> Problem {
    p.residual *= factor;
    p.geometry *= factor;
    for d in &mut p.dwells {
        d.displaced *= factor;
        d.parts.iter_mut().for_each(|part| part.metres /= factor);
    }
    p.candidates.iter_mut().for_each(|c| scale(&mut c.columns, factor));
    p.scans.iter_mut().flat_map(|s| &mut s.points).for_each(|c| scale(&mut c.columns, factor));
    p.channels.iter_mut().for_each(|c| c.columns = Arc::new(c.columns.as_ref() * factor));
    p
}

/// Stays with one linearisation: accepted columns join the geometry.
#[derive(Debug, Clone)]
pub struct LinearRefit {
    base: Problem,
}

impl LinearRefit {
    /// Around a problem.
    pub fn new(base: Problem) -> LinearRefit {
        LinearRefit { base }
    }
}

impl Refit for LinearRefit {
    fn problem(&mut self, accepted: &[Candidate]) -> Result<Problem, DiagnoseError> {
        let mut problem = self.base.clone();
        for candidate in accepted {
            // By name: a candidate may come back with dwells cut out.
            let own = self.base.candidates.iter().chain(self.base.scans.iter().flat_map(|s| &s.points));
            let own = own.into_iter().find(|c| c.spec == candidate.spec).unwrap_or(candidate);
            let columns = own.columns.dense(&problem.dwells, 1.0);
            problem = problem.with_columns(&columns);
        }
        let taken = |c: &Candidate| accepted.iter().any(|a| a.spec == c.spec);
        problem.candidates.retain(|c| !taken(c));
        problem.scans.retain(|s| !s.points.iter().any(taken));
        Ok(problem)
    }
}
