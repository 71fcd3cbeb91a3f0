//! Markers that are on one link keep their distances: one that was swapped or hit in single dwells is known by that alone.
//!
//! Within a recording the distance of two markers of one link is what it is in most dwells. Where a marker is off in every
//! distance to the others, and these agree among themselves, it is rejected and the rest of its pose is kept. Of two markers
//! nobody can say which one is off: that is said, and the fit's own weight decides. What lasts is no accident: a marker that came
//! loose is for the diagnosis.

use armcal_core::robust::{MAD_TO_SIGMA, median};
use armcal_core::{Code, Dwell, FeatureId, Severity, Stage, TipMeasurement, Warning};
use armcal_model::Model;
use std::collections::BTreeMap;

/// Fewer dwells do not say what a distance is.
const FEWEST: usize = 8;
/// A distance that is off by more than this many standard deviations is wrong; chance does that in none of a million dwells.
const SIGMAS: f64 = 6.0;
/// And by more than this [m]: what markers and their mounts give.
const LEAST_M: f64 = 0.3e-3;
/// More of its dwells than this share, or so many in a row, are no accidents.
const MOST: f64 = 0.1;
const RUN: usize = 3;

/// Two features of one link in one dwell, further from or nearer to each other than elsewhere.
struct Wrong {
    dwell: usize,
    pair: [FeatureId; 2],
    off_m: f64,
}

/// Takes single markers that are not where their link has them out of the dwells of one recording, and says so.
pub fn reject_outliers(model: &Model, dwells: &mut [Dwell]) -> Vec<Warning> {
    let wrong = wrong_distances(model, dwells);
    let mut accused: BTreeMap<FeatureId, Vec<usize>> = BTreeMap::new();
    let mut unsure: BTreeMap<[FeatureId; 2], Vec<(usize, f64)>> = BTreeMap::new();
    for (at, dwell) in dwells.iter().enumerate() {
        let own: Vec<&Wrong> = wrong.iter().filter(|w| w.dwell == at).collect();
        match sole_outlier(model, dwell, &own) {
            Some(feature) => accused.entry(feature).or_default().push(at),
            None => own.iter().for_each(|w| unsure.entry(w.pair).or_default().push((at, w.off_m))),
        }
    }
    accused.retain(|feature, own| {
        is_accidental(
            own,
            dwells.iter().filter(|d| feature_measurement(model, d, *feature).is_some()).count(),
        )
    });
    unsure.retain(|_, own| is_accidental(&own.iter().map(|(at, _)| *at).collect::<Vec<_>>(), dwells.len()));
    let mut warnings: Vec<Warning> = accused
        .iter()
        .map(|(feature, own)| rejection_warning(model.feature_name(*feature), own, dwells))
        .collect();
    for (feature, own) in &accused {
        for at in own {
            match feature.is_tip() {
                true => dwells[*at].tip = None,
                false => drop(dwells[*at].markers.remove(model.feature_name(*feature))),
            }
        }
    }
    warnings.extend(
        unsure.iter().map(|(pair, own)| told_apart(pair.map(|id| model.feature_name(id)), own, dwells)),
    );
    warnings
}

/// What the sensor saw of a feature during a dwell.
fn feature_measurement<'d>(
    model: &Model,
    dwell: &'d Dwell,
    feature: FeatureId,
) -> Option<&'d TipMeasurement> {
    if feature.is_tip() { dwell.tip.as_ref() } else { dwell.markers.get(model.feature_name(feature)) }
}

/// Every distance within a link that is not what it is elsewhere.
fn wrong_distances(model: &Model, dwells: &[Dwell]) -> Vec<Wrong> {
    let features: Vec<FeatureId> = model.features().map(|(id, _)| id).collect();
    let mut wrong = Vec::new();
    for (k, &a) in features.iter().enumerate() {
        for &b in features[k + 1..].iter().filter(|b| model.on_one_link(a, **b)) {
            let distance = |(dwell, d): (usize, &Dwell)| {
                let (a, b) = (feature_measurement(model, d, a)?, feature_measurement(model, d, b)?);
                let between = a.position_m - b.position_m;
                let along = between.try_normalize(0.0)?;
                let variance_m2 = along.dot(&((a.covariance_m2 + b.covariance_m2) * along));
                Some((dwell, between.norm(), variance_m2))
            };
            let all: Vec<(usize, f64, f64)> = dwells.iter().enumerate().filter_map(distance).collect();
            if all.len() < FEWEST {
                continue;
            }
            let middle_m = median(&all.iter().map(|(_, m, _)| *m).collect::<Vec<_>>());
            let off: Vec<f64> = all.iter().map(|(_, m, _)| (m - middle_m).abs()).collect();
            let scatter_m = MAD_TO_SIGMA * median(&off);
            for ((dwell, m, variance_m2), off_m) in all.iter().zip(&off) {
                if *off_m > LEAST_M.max(SIGMAS * scatter_m.max(variance_m2.sqrt())) {
                    wrong.push(Wrong { dwell: *dwell, pair: [a, b], off_m: m - middle_m });
                }
            }
        }
    }
    wrong
}

/// The one feature of a dwell that is off from all others of its link, of which there are at least two.
fn sole_outlier(model: &Model, dwell: &Dwell, wrong: &[&Wrong]) -> Option<FeatureId> {
    let has = |id: FeatureId| wrong.iter().filter(|w| w.pair.contains(&id)).count();
    let others = |id: FeatureId| {
        let beside = |other: &FeatureId| *other != id && model.on_one_link(id, *other);
        model
            .features()
            .map(|(other, _)| other)
            .filter(beside)
            .filter(|o| feature_measurement(model, dwell, *o).is_some())
            .count()
    };
    let is_alone = |id: &FeatureId| others(*id) >= 2 && has(*id) == others(*id) && has(*id) == wrong.len();
    model.features().map(|(id, _)| id).find(is_alone)
}

/// Whether these are few of so many dwells, and not in a row.
fn is_accidental(own: &[usize], of: usize) -> bool {
    let few = own.len() as f64 <= (MOST * of as f64).max(1.0);
    few && !own.windows(RUN).any(|run| run[RUN - 1] - run[0] == RUN - 1)
}

fn rejection_warning(name: &str, own: &[usize], dwells: &[Dwell]) -> Warning {
    let message = format!(
        "rejected in {}: there its distances to the other markers of its link are not what they are elsewhere, as after a swap or a \
         knock; what else was seen then is used",
        dwell_list(own.iter().map(|at| dwells[*at].id.dwell))
    );
    Warning::new(Severity::Notice, Stage::Dwell, Code::MarkerRejected, format!("marker {name}"), message)
}

fn told_apart([a, b]: [&str; 2], own: &[(usize, f64)], dwells: &[Dwell]) -> Warning {
    let most_m = own.iter().map(|(_, off_m)| off_m.abs()).fold(0.0, f64::max);
    let message = format!(
        "their distance is off by up to {:.2} mm in {}: one of them was swapped or knocked, and nothing on their link tells which; a \
         third marker there would",
        most_m * 1e3,
        dwell_list(own.iter().map(|(at, _)| dwells[*at].id.dwell))
    );
    Warning::new(
        Severity::Notice,
        Stage::Dwell,
        Code::MarkerDistance,
        format!("markers {a} and {b}"),
        message,
    )
}

fn dwell_list(dwells: impl Iterator<Item = usize>) -> String {
    let all: Vec<String> = dwells.map(|d| d.to_string()).collect();
    let more = if all.len() > 8 { ", ..." } else { "" };
    format!("dwell {}{more}", all[..all.len().min(8)].join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;
    use armcal_core::{DwellId, Pose};
    use armcal_model::{Chain, Frame, Frames, Marker};
    use nalgebra::{Matrix3, Vector3};
    use std::path::Path;

    const ARM: &str = "name = \"a\"\n[[rows]]\nname = \"joint1\"\ntheta_deg = 0.0\nd_mm = 0.0\na_mm = 400.0\nalpha_deg = 0.0\n";

    /// An arm with two markers beside its tip on its one link.
    fn arm(markers: &[&str]) -> Model {
        let marker =
            |name: &&str| Marker { link: "joint1".into(), frame: Frame::estimated(*name, Pose::identity()) };
        let chain = Chain::from_dh_toml(ARM, Path::new("a.toml")).expect("an arm");
        let markers = markers.iter().map(marker).collect();
        Model::new(chain, Frames { markers, ..Frames::of_bare_arm() }).expect("a model")
    }

    /// Thirty dwells of a link that turns; what was seen scatters by a few hundredths of a millimetre.
    fn dwells(markers: &[&str]) -> Vec<Dwell> {
        let seen = |k: usize, place: usize| {
            let turn = nalgebra::Rotation3::from_axis_angle(&Vector3::z_axis(), 0.1 * k as f64);
            let jitter = 2e-5 * ((k * (place + 3)) as f64).sin();
            let at =
                Vector3::new(0.4 + 0.03 * place as f64, 0.05 * place as f64 * place as f64 + jitter, 0.02);
            TipMeasurement {
                position_m: turn * at,
                covariance_m2: Matrix3::identity() * 4e-10,
                orientation: None,
                orientation_sigma_rad: f64::INFINITY,
                samples: 50,
                effective_samples: 20.0,
            }
        };
        let dwell = |k: usize| Dwell {
            id: DwellId { recording: 0, dwell: k },
            start_ns: k as i64 * 2_000_000_000,
            end_ns: k as i64 * 2_000_000_000 + 1_000_000_000,
            joint_rad: vec![0.1 * k as f64],
            joint_spread_rad: vec![0.0],
            joint_sigma_rad: vec![0.0],
            effort_nm: None,
            samples: 50,
            effective_samples: 20.0,
            arrival: vec![armcal_core::Arrival::Unknown],
            path_memory_rad: Vec::new(),
            pair_memory_rad: Vec::new(),
            moved_rad: None,
            tip: Some(seen(k, 0)),
            markers: markers
                .iter()
                .enumerate()
                .map(|(m, name)| ((*name).to_owned(), seen(k, m + 1)))
                .collect(),
            temperature_c: None,
            gauges: Default::default(),
        };
        (0..30).map(dwell).collect()
    }

    fn knock(dwells: &mut [Dwell], name: &str, at: std::ops::Range<usize>) {
        for dwell in &mut dwells[at] {
            let turn = nalgebra::Rotation3::from_axis_angle(&Vector3::z_axis(), dwell.joint_rad[0]);
            let off_m = turn * Vector3::new(0.0, 3e-3, 2e-3);
            dwell.markers.get_mut(name).expect("seen").position_m += off_m;
        }
    }

    #[test]
    fn of_three_on_a_link_the_one_that_is_off_is_rejected_alone() {
        let (names, mut all) = (["a", "b"], dwells(&["a", "b"]));
        assert!(reject_outliers(&arm(&names), &mut all).is_empty(), "nothing is wrong");
        knock(&mut all, "b", 7..8);
        knock(&mut all, "a", 19..20);
        let before = all.clone();
        let said = reject_outliers(&arm(&names), &mut all);
        let told: Vec<(&str, &str)> = said.iter().map(|w| (w.code.as_str(), w.subject.as_str())).collect();
        assert_eq!(told, [("marker-rejected", "marker a"), ("marker-rejected", "marker b")]);
        assert!(said[1].message.starts_with("rejected in dwell 7:"), "{}", said[1].message);
        assert!(
            !all[7].markers.contains_key("b") && all[7].markers.contains_key("a") && all[7].tip.is_some()
        );
        assert!(!all[19].markers.contains_key("a") && all[19].markers.contains_key("b"));
        assert_eq!(all[8..19], before[8..19]);
    }

    #[test]
    fn of_two_nobody_can_tell_which_and_both_stay() {
        let (names, mut all) = (["a"], dwells(&["a"]));
        knock(&mut all, "a", 7..8);
        let before = all.clone();
        let said = reject_outliers(&arm(&names), &mut all);
        assert_eq!((said.len(), said[0].code.as_str()), (1, "marker-distance"));
        assert!(
            said[0].subject == "markers tip and a" && said[0].message.contains("in dwell 7:"),
            "{said:?}"
        );
        assert_eq!(all, before);
    }

    #[test]
    fn a_marker_that_came_loose_is_left_to_the_diagnosis() {
        for from in [15, 27] {
            let (names, mut all) = (["a", "b"], dwells(&["a", "b"]));
            knock(&mut all, "b", from..30);
            let before = all.clone();
            assert!(reject_outliers(&arm(&names), &mut all).is_empty(), "from dwell {from}");
            assert_eq!(all, before);
        }
    }
}
