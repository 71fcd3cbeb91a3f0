//! The arm and the frames at its ends.

use super::Draft;
use crate::error::InitError;
use crate::known::Known;
use crate::page::{toml_float, toml_path, toml_string};
use crate::roles::Role;
use crate::seats::median_tilt_rad;
use armcal_core::robust::median;
use armcal_model::{Model, Motion, Moving};
use nalgebra::Vector3;
use std::collections::BTreeSet;

/// Bases that lean by more than this do not stand upright in the sensor's frame [rad].
const LEANS_RAD: f64 = 0.15;

impl Draft<'_> {
    pub fn model(&mut self) -> Result<(), InitError> {
        let Known { arm, sockets, .. } = self.known;
        self.page.section("[model]");
        if !arm.is_urdf() {
            let line = format!("dh = {}", toml_path(&arm.file, &self.folder));
            self.page.line(&line, &format!("given: {} moving joints", arm.names.len()));
            return Ok(());
        }
        let why = match (arm.recorded, &self.known.asked.told.urdf) {
            (true, _) => "as the recording has it in /robot_description",
            (false, None) => "the only one beside the recordings",
            (false, Some(_)) => "given",
        };
        let path = if arm.recorded { self.beside(".urdf", arm.text.clone()) } else { arm.file.clone() };
        self.page.line(&format!("urdf = {}", toml_path(&path, &self.folder)), why);
        let base = arm.base_link.as_deref().unwrap_or_default();
        self.page.line(&format!("base_link = {}", toml_string(base)), "before the first recorded joint");
        let found = sockets.as_ref().and_then(|s| s.tip_link.as_ref());
        let tip = found.or(arm.tips.first()).cloned().unwrap_or_default();
        let fixed = arm.tips.len();
        let why = match sockets.as_ref().map(|s| (s.scatter_m * 1e3, &s.next_scatter_m)) {
            Some((own_mm, Some((next, next_m)))) => {
                format!(
                    "of {fixed} links behind the last joint the one that pauses in the fewest places: {own_mm:.1} mm, {next} {:.1} mm",
                    next_m * 1e3
                )
            }
            Some(_) if fixed > 1 => {
                format!("of {fixed} links behind the last joint the only one that pauses in a few places")
            }
            _ if fixed > 1 => format!(
                "one of {fixed} links behind the last joint; where the tip is from there is estimated"
            ),
            _ => "behind the last recorded joint".to_owned(),
        };
        self.page.line(&format!("tip_link = {}", toml_string(&tip)), &why);
        self.page.section("[model.deviation]");
        self.page.line(
            "prior_sigma_mm = 0.3",
            "assumed, as of an arm from a factory: castings within some tenths of a millimetre",
        );
        self.page.line(
            "prior_sigma_deg = 0.1",
            "and of a degree; without this section both are learnt from the recordings",
        );
        self.unseen.push("how exactly the arm was built: [model.deviation] assumes a factory; remove it, and the [[parameters]] below it, to have that learnt".to_owned());
        for pattern in zero_patterns(&arm.model_to(&tip)?)? {
            self.page.section("[[parameters]]");
            self.page.line(
                &format!("name = {}", toml_string(&pattern)),
                "zeros of the joints, which are set by hand:",
            );
            self.page.line("prior = 1.0", "within a degree");
        }
        Ok(())
    }

    pub fn frames(&mut self) {
        let known = self.known;
        let tip = known.of_role(Role::Tip);
        let by_points = !known.points.is_empty();
        let sensor = by_points || tip.is_some() || known.markers().any(|(_, _, cast)| cast.sure);
        self.page.section("[frames.base]");
        if known.of_role(Role::Base).is_some() {
            self.page.line("pose = \"measured\"", "by the body on the base");
            self.page.line("sigma_mm = 0.3", "assumed: how well its markers represent the base frame");
            self.page.line("sigma_deg = 0.05", "");
            self.unseen.push(
                "how well the markers on the base represent its frame: sigma_mm, sigma_deg of [frames.base]"
                    .to_owned(),
            );
        } else if sensor {
            self.page
                .line("pose = \"estimated\"", "no body stands where the base is: the sensor stands anywhere");
        } else {
            self.page.line("pose = \"given\"", "without a sensor the base is the world");
        }
        let last = known.arm.carried.len() - 1;
        let followed = tip
            .map(|t| &known.evidence[t])
            .or(known.markers().find(|m| m.2.sure).map(|m| &known.evidence[m.0]));
        let link = tip.map_or_else(|| known.markers().find(|m| m.2.sure).map_or(last, |m| m.1), |_| last);
        let bases: Vec<_> =
            followed.into_iter().flat_map(|e| e.placed(link)).map(|(_, p)| p.base.rotation).collect();
        let is_seated = tip.is_some_and(|t| known.cast[t].is_tool_point);
        self.page.section("[frames.tip]");
        if is_seated {
            self.page.line("pose = \"given\"", "the body's origin is the tool point: it was in the cavities");
        } else if !known.arm.is_urdf() && tip.is_none() && !by_points {
            self.page.line("pose = \"given\"", "the last row of the table ends at the tool point");
        } else {
            self.page.line(
                "pose = \"estimated\"",
                if by_points {
                    "where the target sits on the last link"
                } else if tip.is_some() {
                    "where the body sits on the last link"
                } else {
                    "where the tool point is on the last link"
                },
            );
            if let Some(at_m) = tip.and_then(|t| self.tip_at_m(t, last)) {
                let at: Vec<String> = at_m.iter().map(|x| toml_float(*x, 3)).collect();
                self.page.line(
                    &format!("at = {{ xyz_m = [{}] }}", at.join(", ")),
                    "where the nominal arm would have it: a start",
                );
            }
        }
        if by_points {
            self.unseen.push(
                "whether the tracker was levelled: where it was not, give vertical = \"base\" in [frames]"
                    .to_owned(),
            );
        }
        if sensor && !bases.is_empty() && median_tilt_rad(&bases) > LEANS_RAD {
            let lean_deg = median_tilt_rad(&bases).to_degrees();
            self.page.section("[frames]");
            self.page.line(
                "vertical = \"base\"",
                &format!("the base leans by {lean_deg:.0} deg in the sensor's frame"),
            );
            self.unsure.push(format!(
                "which way is up: the base leans by {lean_deg:.0} deg in the sensor's frame, taken as a sensor that is not levelled; for \
                 an arm that leans itself remove vertical"
            ));
        }
    }

    /// Where a body on the last link is from the tip of the model [m].
    fn tip_at_m(&self, tip: usize, last: usize) -> Option<Vector3<f64>> {
        let arm = self.known.arm;
        let placed: Vec<Vector3<f64>> = self.known.evidence[tip].placed(last).map(|(_, p)| p.at_m).collect();
        let poses = arm.poses(&vec![0.0; arm.carried.len()]);
        let tip_from_link = poses[last + 1].inverse() * poses[last];
        let axis = |k: usize| median(&placed.iter().map(|p| p[k]).collect::<Vec<_>>());
        let at = Vector3::new(axis(0), axis(1), axis(2));
        (!placed.is_empty()).then(|| tip_from_link.transform_point(&at.into()).coords)
    }
}

/// Patterns of the parameters that are the zeros of the joints: rotations of their origins about their own axes.
fn zero_patterns(model: &Model) -> Result<Vec<String>, InitError> {
    let skeleton = model.skeleton(0, &model.nominal(), "base");
    let along = |moving: &Moving| {
        ["rx", "ry", "rz"]
            .into_iter()
            .zip(moving.axis.iter())
            .find(|(_, x)| x.abs() > 0.999)
            .map(|(name, _)| name)
    };
    let turning = skeleton.joints.iter().filter_map(|joint| {
        let moving = joint.moves.as_ref().filter(|m| m.motion == Motion::Revolute && m.follows.is_none())?;
        Some(format!("{}.{}", joint.name, along(moving)?))
    });
    let names: Vec<String> = turning.filter(|name| model.index(name).is_some()).collect();
    let Some(first) = names.first() else { return Ok(names) };
    let common = |chars: &mut dyn Iterator<Item = (usize, char)>,
                  same: &dyn Fn(&str, usize) -> Option<char>| {
        chars
            .take_while(|(at, c)| names.iter().all(|n| same(n, *at) == Some(*c)))
            .map(|(_, c)| c)
            .collect::<String>()
    };
    let head = common(&mut first.chars().enumerate(), &|n, at| n.chars().nth(at));
    let tail: String = common(&mut first.chars().rev().enumerate(), &|n, at| n.chars().rev().nth(at))
        .chars()
        .rev()
        .collect();
    let short = names.iter().map(String::len).min().unwrap_or(0);
    let pattern = format!("{head}*{tail}");
    let own: BTreeSet<Option<usize>> = names.iter().map(|n| model.index(n)).collect();
    let fits = head.len() + tail.len() <= short
        && names.len() > 1
        && model.matching(&pattern)?.into_iter().map(Some).collect::<BTreeSet<_>>() == own;
    Ok(if fits { vec![pattern] } else { names })
}
