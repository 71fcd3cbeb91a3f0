//! Recordings, streams, clock: what is read, and as what.

use super::Draft;
use crate::evidence::Evidence;
use crate::page::{toml_float, toml_list, toml_path, toml_string};
use crate::points::Points;
use crate::read::body_key;
use crate::roles::Role;
use crate::seats::table_tilts;
use crate::topics::BodyTopic;
use armcal_config::recording_name;
use armcal_core::PoseSamples;
use armcal_recording::{Axis, JointUnit, LengthUnit, StreamReport};
use armcal_table::Tilt;
use std::collections::BTreeSet;

/// Why a key is there that changes what was recorded.
const UNDONE: &str = "undoes what contradicts the data, as said above";
/// A sensor that is later than this is searched around its delay [s].
const LATE_S: f64 = 1.5;
/// Noise of a sensor that shows none by itself, until a first calibration tells more [mm].
const ASSUMED_MM: f64 = 0.1;
/// A tilt worth declaring [rad].
const TILT_RAD: f64 = 0.01;

impl Draft<'_> {
    pub fn recordings(&mut self) {
        let known = self.known;
        let table = known.of_role(Role::Table).zip(known.board);
        let tilts: Vec<Option<Tilt>> =
            table.map_or(Vec::new(), |(table, (_, board))| table_tilts(board, &known.evidence[table]));
        for (at, (opened, read)) in known.opened.iter().zip(&known.read.recordings).enumerate() {
            self.page.section("[[recordings]]");
            let paths: Vec<String> = opened.entry.paths.iter().map(|p| toml_path(p, &self.folder)).collect();
            let times = &read.samples.joints.time_ns;
            let length_s = times.last().zip(times.first()).map_or(0.0, |(b, a)| (b - a) as f64 * 1e-9);
            let parts = if paths.len() > 1 { format!("{} parts, ", paths.len()) } else { String::new() };
            let why = format!("{parts}{length_s:.0} s, the joints pause {} times", read.dwells.len());
            self.page.line(&format!("paths = [{}]", paths.join(", ")), &why);
            if recording_name(None, &opened.entry.paths) != read.name {
                self.page.line(&format!("name = {}", toml_string(&read.name)), "");
            }
            if let Some(points) = known.points.get(at) {
                self.points(points);
            }
            let below =
                known.seats.iter().flat_map(|s| &s.turned).find(|(r, _)| *r == at).map(|(_, tilt)| *tilt);
            if let Some(tilt) = below.or(tilts.get(at).copied().flatten()) {
                let angles = [("roll_deg", tilt.roll_rad), ("pitch_deg", tilt.pitch_rad)];
                let angles = angles.iter().filter(|(_, rad)| rad.abs() > TILT_RAD);
                let angles: Vec<String> =
                    angles.map(|(key, rad)| format!("{key} = {}", toml_float(rad.to_degrees(), 1))).collect();
                if !angles.is_empty() {
                    let why = "how the table was turned against the recording in which it is most level";
                    self.page.line(&format!("tilt = {{ {} }}", angles.join(", ")), why);
                }
            }
        }
        self.unseen.push(
            "what the arm carried: load_kg = .. under each [[recordings]], where it carried anything"
                .to_owned(),
        );
    }

    /// What a laser tracker exported beside a recording.
    fn points(&mut self, points: &Points) {
        let file = points.path.display();
        let unit = match points.unit {
            Some(LengthUnit::M) => "m",
            _ => "mm",
        };
        let time =
            points.time.as_ref().map_or(String::new(), |time| format!(", time = {}", toml_string(time)));
        let csv = toml_path(&points.path, &self.folder);
        let how = if points.time.is_some() { "by their times" } else { "dwells in their order" };
        self.page.line(
            &format!("points = {{ csv = {csv}, unit = \"{unit}\", sigma_mm = 0.05{time} }}"),
            &format!("given: {} rows, {how}; sigma_mm is assumed", points.rows),
        );
        if points.unit.is_none() {
            self.unsure.push(format!("the unit of {file}, which its header does not say: taken as mm"));
        }
        for (column, why) in &points.unread {
            self.unsure.push(format!("the column {column} of {file}, which is not read as times: {why}"));
        }
        if points.time.is_none() && points.unread.is_empty() {
            self.unseen.push(format!("when the points of {file} were measured: no column is called a time"));
        }
        self.unseen.push(format!("how exactly the points of {file} were measured: sigma_mm"));
    }

    pub fn streams(&mut self) {
        let known = self.known;
        let joints = &known.read.streams.joints[0];
        self.page.section("[streams.joints]");
        let report = known.read.recordings.first().and_then(|r| r.report("joints"));
        self.page.line(&format!("topic = {}", toml_string(&joints.topic)), &rate_note(report));
        let source = &known.arm.source;
        let why = match source.names.is_empty() {
            true => "as the model has them: the messages name none",
            false => "as recorded, in the order of the model",
        };
        self.page.line(&format!("names = {}", toml_list(&joints.names)), why);
        if let Some(field) = &source.field {
            let paths = match field.positions.as_slice() {
                [only] => toml_string(only),
                several => toml_list(several),
            };
            self.page.line(&format!("position = {paths}"), &field.why);
            if let Some(name) = &field.name {
                self.page.line(&format!("name = {}", toml_string(name)), "the names beside them");
            }
        }
        if joints.unit == JointUnit::Deg {
            self.page.line("unit = \"deg\"", "the readings are too large for radians");
        }
        for (key, list) in [("factors", &joints.factors), ("zeros_deg", &joints.zeros_deg)] {
            if !list.is_empty() {
                self.page.line(&format!("{key} = {list:?}"), UNDONE);
            }
        }
        let sections = [(Role::Tip, "tip"), (Role::Base, "base")];
        for (body, section) in
            sections.iter().filter_map(|(role, section)| Some((known.of_role(*role)?, *section)))
        {
            self.body(body, section);
        }
        if let Some(table) = known.of_role(Role::Table).filter(|_| known.seats.is_some()) {
            self.body(table, "table");
        }
        let mut taken = BTreeSet::new();
        for (body, link, cast) in known.markers() {
            let carried = &known.arm.carried[link];
            let name = marker_name(&known.read.bodies[body], &mut taken);
            if !cast.sure {
                self.unsure.push(format!(
                    "{} is on the arm, but not surely on {carried}: left out ({})",
                    known.read.bodies[body].shown(),
                    cast.why
                ));
                continue;
            }
            self.body(body, &format!("bodies.{name}"));
            self.page.section(&format!("[markers.{name}]"));
            self.page.line(
                &format!("link = {}", toml_string(carried)),
                "the link that it follows; where on it is estimated",
            );
        }
        if let Some(temperature) = &known.read.streams.temperature {
            self.page.section("[streams.temperature]");
            let report = known.read.recordings.first().and_then(|r| r.report("temperature"));
            self.page.line(&format!("topic = {}", toml_string(&temperature.topic)), &rate_note(report));
        } else {
            let called = known.warm.iter().map(|(topic, path)| format!("topic {topic} with value {path}"));
            let called: Vec<String> = called.collect();
            let called = match called.is_empty() {
                true => String::new(),
                false => format!("; numbers called so, for [streams.temperature]: {}", called.join(", ")),
            };
            self.unseen.push(format!("the temperature: effects of heat go by time alone{called}"));
        }
        for (body, cast) in known.read.bodies.iter().zip(known.cast) {
            match cast.role {
                Role::Still | Role::Other | Role::Computed | Role::Unknown => {
                    let unsure = if cast.sure { "" } else { " (unsure)" };
                    self.page.note(&format!("not used: {}, which {}{unsure}", body.shown(), cast.why));
                }
                Role::Table if known.seats.is_none() => {
                    self.page.note(&format!("{}: the table, as it seems; {}", body.shown(), cast.why))
                }
                _ => {}
            }
            if !cast.sure && cast.role != Role::Unknown && !matches!(cast.role, Role::Marker(_)) {
                self.unsure.push(format!("{} as {}: {}", body.shown(), cast.role.word(), cast.why));
            }
        }
        self.clock();
        self.noise_of_one_pose();
    }

    /// A tip that was seen once a pause shows no scatter.
    fn noise_of_one_pose(&mut self) {
        let Some(tip) = self.known.of_role(Role::Tip) else { return };
        let seen = self.known.read.recordings.iter().filter_map(|r| r.body(tip));
        if seen.into_iter().any(PoseSamples::is_one_a_stop) {
            self.page.section("[observations]");
            let (mm, why) = match self.known.noise_mm {
                Some(mm) => {
                    (mm, "at most: a first calibration leaves no more, and one pose a stop shows no scatter")
                }
                None => (ASSUMED_MM, "assumed: one pose a stop shows no scatter; declare yours"),
            };
            self.page.line(&format!("sensor_sigma_mm = {}", toml_float(mm, 4)), why);
        }
    }

    fn body(&mut self, body: usize, section: &str) {
        let known = self.known;
        let stream = &known.read.streams.bodies[&body_key(body)];
        self.page.section(&format!("[streams.{section}]"));
        let report =
            known.read.recordings.iter().find_map(|r| r.report(&format!("bodies.{}", body_key(body))));
        self.page.line(&format!("topic = {}", toml_string(&stream.topic)), &known.cast[body].why);
        if let Some(name) = &stream.body {
            self.page.line(&format!("body = {}", toml_string(name)), "the topic has several");
        }
        if let Some(frame) = &stream.frame {
            self.page.line(
                &format!("frame = {}", toml_string(frame)),
                "over the transforms between, as the bodies hang on several frames",
            );
        }
        let fields = [("position", &stream.position), ("orientation", &stream.orientation)];
        for (key, path) in fields.into_iter().filter_map(|(key, path)| Some((key, path.as_ref()?))) {
            self.page.line(&format!("{key} = {}", toml_string(path)), "a field of the message");
        }
        if stream.unit == LengthUnit::Mm {
            self.page.line("unit = \"mm\"", "too far away for metres");
        }
        if let Some(rate) = stream.clock_rate {
            let why =
                "its stamps run so many times as fast as those of the joints: only then do the speeds agree";
            self.page.line(&format!("clock_rate = {rate:.6}"), why);
        }
        if let Some(scale) = stream.scale {
            self.page.line(&format!("scale = {scale}"), UNDONE);
        }
        if let Some(axes) = stream.axes {
            self.page.line(&format!("axes = {:?}", axes.map(Axis::word)), UNDONE);
        }
        if let Some(axes) = stream.orientation_axes {
            let why = "its attitude is published in other axes than its position";
            self.page.line(&format!("orientation_axes = {:?}", axes.map(Axis::word)), why);
        }
        if stream.invert {
            self.page.line("invert = true", UNDONE);
        }
        self.page.note(&rate_note(report));
    }

    fn clock(&mut self) {
        let moving =
            self.known.evidence.iter().filter_map(Evidence::likeness).filter(|l| l.correlation > 0.5);
        let Some(clearest) = moving.max_by(|a, b| a.correlation.total_cmp(&b.correlation)) else { return };
        if clearest.delay_s.abs() > LATE_S {
            self.page.section("[clock]");
            let toml = format!("initial_offset_s = {}", toml_float(clearest.delay_s, 1));
            self.page.line(
                &toml,
                &format!(
                    "the sensor's clock is about so far ahead (correlation of speeds {:.2})",
                    clearest.correlation
                ),
            );
        }
    }
}

fn rate_note(report: Option<&StreamReport>) -> String {
    report.map_or(String::new(), |r| {
        let occluded = r.occluded.total();
        let hidden = if occluded > 0 {
            format!(", {occluded} of {} frames occluded", r.messages)
        } else {
            String::new()
        };
        format!("{:.1} Hz{hidden}; {} clock: {}", r.rate_hz, r.clock.word(), r.clock_reason)
    })
}

/// What a marker is called: the last of its own name, in letters that a section may have.
fn marker_name(body: &BodyTopic, taken: &mut BTreeSet<String>) -> String {
    let own = body.body.as_deref().unwrap_or(&body.topic);
    let last = own.rsplit('/').find(|part| !part.is_empty()).unwrap_or("body");
    let plain: String =
        last.chars().map(|c| if c.is_ascii_alphanumeric() || "_-".contains(c) { c } else { '_' }).collect();
    let reserved = ["tip", "base", "board", "world", "table"].contains(&plain.as_str());
    let plain = if reserved { format!("marker_{plain}") } else { plain };
    let mut name = plain.clone();
    for n in 2.. {
        if taken.insert(name.clone()) {
            break;
        }
        name = format!("{plain}_{n}");
    }
    name
}
