//! The proposal: what was found, as the sections of a pipeline.

use super::arm::Arm;
use super::channels::BodyTopic;
use super::evidence::Evidence;
use super::files::Opened;
use super::page::{Page, list, number, quoted, relative};
use super::read::{AllRead, key};
use super::roles::{Cast, Role};
use super::seats::{Seats, lean, tilts};
use super::sockets::Sockets;
use super::{Asked, Tried};
use crate::error::Error;
use crate::pipeline::Pipeline;
use armcal_core::robust::median;
use armcal_model::{Model, Moving};
use armcal_recording::{JointUnit, LengthUnit, StreamReport, atomic};
use armcal_table::{Board, Tilt};
use nalgebra::Vector3;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// First line of a proposal: what makes it one of armcal's files.
const MARK: &str = "armcal.pipeline/1, proposed by `armcal init`; every line may be changed";
/// A sensor that is later than this is searched around its delay [s].
const LATE_S: f64 = 1.5;
/// Bases that lean by more than this do not stand upright in the sensor's frame [rad].
const LEANS_RAD: f64 = 0.15;
/// A tilt worth declaring [rad].
const TILT_RAD: f64 = 0.01;
/// More cavities than this are a board rather than a few sockets.
const FEW_SOCKETS: usize = 9;

/// A pipeline that may be written.
pub struct Proposal {
    /// The pipeline, as the program reads it.
    pub pipeline: Pipeline,
    /// Its file.
    pub out: PathBuf,
    /// Files that it names and that are still to be written.
    pub beside: Vec<(PathBuf, String)>,
    /// The bodies and their roles.
    pub bodies: Vec<(BodyTopic, Cast)>,
    /// What may be otherwise.
    pub unsure: Vec<String>,
    /// What nothing in the recordings shows, and where to fill it in.
    pub unseen: Vec<String>,
    /// Topics that are not used, and why.
    pub left: Vec<(String, String)>,
    /// What a first calibration came to, or why there was none.
    pub tried: Option<Result<Tried, String>>,
}

impl Proposal {
    /// Whether a first calibration with it went well.
    pub fn runs(&self) -> bool {
        matches!(&self.tried, Some(Ok(tried)) if tried.mistakes.is_empty())
    }

    /// The same pipeline with the unwritten files in another folder.
    pub fn in_folder(&self, folder: &Path) -> Result<Pipeline, Error> {
        let mut pipeline = self.pipeline.clone();
        for (path, text) in &self.beside {
            let copy = folder.join(path.file_name().unwrap_or_default());
            atomic::write(&copy, text.as_bytes()).map_err(Error::Output)?;
            if path.extension().is_some_and(|e| e == "urdf") {
                pipeline.model.urdf = Some(copy);
            } else if let Some(table) = &mut pipeline.table {
                table.board = copy;
            }
        }
        Ok(pipeline)
    }
}

/// Everything that was found out.
pub struct Known<'a> {
    /// What the user said.
    pub asked: &'a Asked,
    /// The recordings.
    pub opened: &'a [Opened],
    /// The arm.
    pub arm: &'a Arm,
    /// What was read.
    pub read: &'a AllRead,
    /// What the bodies did.
    pub evidence: &'a [Evidence],
    /// What they are.
    pub cast: &'a [Cast],
    /// Which of them fit the board.
    pub seats: Option<Seats>,
    /// The board of the user.
    pub board: Option<(&'a Path, &'a Board)>,
    /// Sockets without a drawing.
    pub sockets: Option<Sockets>,
}

/// A proposal on its way to its text.
struct Draft<'a> {
    known: &'a Known<'a>,
    page: Page,
    folder: PathBuf,
    beside: Vec<(PathBuf, String)>,
    unsure: Vec<String>,
    unseen: Vec<String>,
}

impl Known<'_> {
    /// The proposal, parsed by the very reader of pipelines.
    pub fn propose(&self, mut left: Vec<(String, String)>) -> Result<Proposal, Error> {
        let folder = self.asked.out.parent().unwrap_or(Path::new("")).to_owned();
        let (beside, unsure, unseen) = (Vec::new(), self.arm.unsure.clone(), Vec::new());
        let mut draft = Draft { known: self, page: Page::default(), folder, beside, unsure, unseen };
        draft.recordings();
        draft.streams();
        draft.table();
        draft.model()?;
        draft.frames();
        draft.holdout();
        let Draft { page, folder, beside, unsure, unseen, .. } = draft;
        let mut head = Page::default();
        head.note(MARK);
        for (what, all) in [("unsure", &unsure), ("not visible in the recordings", &unseen)] {
            all.iter().for_each(|said| head.note(&format!("{what}: {said}")));
        }
        let name = self.asked.out.file_stem().unwrap_or_default().to_string_lossy();
        head.line(&format!("name = {}", quoted(&name)), "");
        let text = head.text() + &page.text();
        let pipeline = Pipeline::proposed(&self.asked.out, text, &folder)?;
        left.extend(self.read.left.clone());
        let bodies = self.read.bodies.iter().cloned().zip(self.cast.iter().cloned()).collect();
        Ok(Proposal {
            pipeline,
            out: self.asked.out.clone(),
            beside,
            bodies,
            unsure,
            unseen,
            left,
            tried: None,
        })
    }

    fn of_role(&self, role: Role) -> Option<usize> {
        self.cast.iter().position(|c| c.role == role)
    }

    /// Bodies on the links of the arm beside the tip.
    fn markers(&self) -> impl Iterator<Item = (usize, usize, &Cast)> {
        let marker = |(at, cast): (usize, &'_ Cast)| match cast.role {
            Role::Marker(link) => Some((at, link)),
            _ => None,
        };
        self.cast
            .iter()
            .enumerate()
            .filter_map(move |(at, cast)| marker((at, cast)).map(|(at, link)| (at, link, cast)))
    }

    fn pauses(&self) -> usize {
        self.read.recordings.iter().map(|r| r.dwells.len()).sum()
    }
}

impl Draft<'_> {
    fn recordings(&mut self) {
        let known = self.known;
        let table = known.of_role(Role::Table).zip(known.board);
        let tilts: Vec<Option<Tilt>> =
            table.map_or(Vec::new(), |(table, (_, board))| tilts(board, &known.evidence[table]));
        for (at, (opened, read)) in known.opened.iter().zip(&known.read.recordings).enumerate() {
            self.page.section("[[recordings]]");
            let paths: Vec<String> = opened.entry.paths.iter().map(|p| relative(p, &self.folder)).collect();
            let times = &read.samples.joints.time_ns;
            let length_s = times.last().zip(times.first()).map_or(0.0, |(b, a)| (b - a) as f64 * 1e-9);
            let parts = if paths.len() > 1 { format!("{} parts, ", paths.len()) } else { String::new() };
            let why = format!("{parts}{length_s:.0} s, the joints pause {} times", read.dwells.len());
            self.page.line(&format!("paths = [{}]", paths.join(", ")), &why);
            let stem = opened.entry.paths[0].file_stem().map(|s| s.to_string_lossy());
            if stem.is_none_or(|stem| stem != read.name) {
                self.page.line(&format!("name = {}", quoted(&read.name)), "");
            }
            if let Some(tilt) = tilts.get(at).copied().flatten() {
                let angles = [("roll_deg", tilt.roll_rad), ("pitch_deg", tilt.pitch_rad)];
                let angles = angles.iter().filter(|(_, rad)| rad.abs() > TILT_RAD);
                let angles: Vec<String> =
                    angles.map(|(key, rad)| format!("{key} = {}", number(rad.to_degrees(), 1))).collect();
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

    fn streams(&mut self) {
        let known = self.known;
        let joints = &known.read.streams.joints[0];
        self.page.section("[streams.joints]");
        let report = known.read.recordings.first().and_then(|r| r.report("joints"));
        self.page.line(&format!("topic = {}", quoted(&joints.topic)), &rate(report));
        self.page.line(&format!("names = {}", list(&joints.names)), "as recorded, in the order of the model");
        if joints.unit == JointUnit::Deg {
            self.page.line("unit = \"deg\"", "the readings are too large for radians");
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
                    shown(&known.read.bodies[body]),
                    cast.why
                ));
                continue;
            }
            self.body(body, &format!("bodies.{name}"));
            self.page.section(&format!("[markers.{name}]"));
            self.page.line(
                &format!("link = {}", quoted(carried)),
                "the link that it follows; where on it is estimated",
            );
        }
        if let Some(temperature) = &known.read.streams.temperature {
            self.page.section("[streams.temperature]");
            let report = known.read.recordings.first().and_then(|r| r.report("temperature"));
            self.page.line(&format!("topic = {}", quoted(&temperature.topic)), &rate(report));
        } else {
            self.unseen.push("the temperature: effects of heat go by time alone".to_owned());
        }
        for (body, cast) in known.read.bodies.iter().zip(known.cast) {
            match cast.role {
                Role::Still | Role::Other | Role::Unknown => {
                    let unsure = if cast.sure { "" } else { " (unsure)" };
                    self.page.note(&format!("not used: {}, which {}{unsure}", shown(body), cast.why));
                }
                Role::Table if known.seats.is_none() => {
                    self.page.note(&format!("{}: the table, as it seems; {}", shown(body), cast.why))
                }
                _ => {}
            }
            if !cast.sure && cast.role != Role::Unknown && !matches!(cast.role, Role::Marker(_)) {
                self.unsure.push(format!("{} as {}: {}", shown(body), cast.role.word(), cast.why));
            }
        }
        self.clock();
    }

    fn body(&mut self, body: usize, section: &str) {
        let known = self.known;
        let stream = &known.read.streams.bodies[&key(body)];
        self.page.section(&format!("[streams.{section}]"));
        let report = known.read.recordings.iter().find_map(|r| r.report(&format!("bodies.{}", key(body))));
        self.page.line(&format!("topic = {}", quoted(&stream.topic)), &known.cast[body].why);
        if let Some(name) = &stream.body {
            self.page.line(&format!("body = {}", quoted(name)), "the topic has several");
        }
        if stream.unit == LengthUnit::Mm {
            self.page.line("unit = \"mm\"", "too far away for metres");
        }
        self.page.note(&rate(report));
    }

    fn clock(&mut self) {
        let moving =
            self.known.evidence.iter().filter_map(Evidence::likeness).filter(|l| l.correlation > 0.5);
        let Some(clearest) = moving.max_by(|a, b| a.correlation.total_cmp(&b.correlation)) else { return };
        if clearest.delay_s.abs() > LATE_S {
            self.page.section("[clock]");
            let toml = format!("initial_offset_s = {}", number(clearest.delay_s, 1));
            self.page.line(
                &toml,
                &format!(
                    "the sensor's clock is about so far ahead (correlation of speeds {:.2})",
                    clearest.correlation
                ),
            );
        }
    }

    fn table(&mut self) {
        let known = self.known;
        if let Some(sockets) = &known.sockets {
            let path = self.beside("-sockets.toml", sockets_toml(sockets));
            self.page.section("[table]");
            let visits: Vec<String> = sockets.visits.iter().map(usize::to_string).collect();
            let why = format!(
                "no sensor sees the tip; it came back to {} places in other postures ({} pauses), within {:.1} mm by the nominal arm",
                visits.len(),
                visits.join(", "),
                sockets.scatter_m * 1e3
            );
            self.page.line(&format!("board = {}", relative(&path, &self.folder)), &why);
            self.page.line("pose = \"estimated\"", "one pose a recording, unknown");
            self.page.section("[table.association]");
            let names: Vec<&str> = sockets.board.cavities.iter().map(|c| c.name.as_str()).collect();
            self.page.line(
                &format!("visiting_order = {}", list(&names)),
                "in the order of their first visit in every recording",
            );
            if names.len() > 1 {
                self.unsure.push(format!(
                    "the size of the fixture: {} is written with the distances at which the calibration errs least; a drawing is better",
                    path.file_name().unwrap_or_default().to_string_lossy()
                ));
            }
            self.unseen.push(
                "tolerances of the sockets: cavity_sigma_mm and seat_sigma_mm of the fixture are assumed"
                    .to_owned(),
            );
            return;
        }
        let Some((path, board)) = known.board else {
            if known.of_role(Role::Tip).is_some() {
                self.unseen.push("a board: give --board FILE if the tip sat in its cavities; only what the sensor sees is used now".to_owned());
            }
            return;
        };
        self.page.section("[table]");
        self.page.line(
            &format!("board = {}", relative(path, &self.folder)),
            &format!("given: {} cavities", board.cavities.len()),
        );
        match &known.seats {
            Some(seats) => {
                self.page.line("pose = \"measured\"", &seats.why);
                let names = seats.unfit.iter().map(|r| known.read.recordings[*r].name.as_str());
                let unfit: Vec<&str> = names.collect();
                if !unfit.is_empty() {
                    self.unsure.push(format!(
                        "cavities do not fit the pauses in {}: if the markers are on the frame below a tilting mechanism, set \
                         markers_on = \"frame\" and declare tilt",
                        unfit.join(", ")
                    ));
                }
            }
            None => {
                let why = match known.cast.iter().any(|c| matches!(c.role, Role::Still | Role::Table)) {
                    true => "in the frame of no body that stands still are cavities where the tip paused",
                    false => "nothing sees the board: one pose a recording, fitted with the arm",
                };
                self.page.line("pose = \"estimated\"", why);
            }
        }
    }

    fn model(&mut self) -> Result<(), Error> {
        let Known { arm, sockets, .. } = self.known;
        self.page.section("[model]");
        if !arm.is_urdf() {
            let line = format!("dh = {}", relative(&arm.file, &self.folder));
            self.page.line(&line, &format!("given: {} moving joints", arm.names.len()));
            return Ok(());
        }
        let why = if arm.recorded { "as the recording has it in /robot_description" } else { "given" };
        let path = if arm.recorded { self.beside(".urdf", arm.text.clone()) } else { arm.file.clone() };
        self.page.line(&format!("urdf = {}", relative(&path, &self.folder)), why);
        let base = arm.base_link.as_deref().unwrap_or_default();
        self.page.line(&format!("base_link = {}", quoted(base)), "before the first recorded joint");
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
        self.page.line(&format!("tip_link = {}", quoted(&tip)), &why);
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
        for pattern in zeros(&arm.model_to(&tip)?)? {
            self.page.section("[[parameters]]");
            self.page
                .line(&format!("name = {}", quoted(&pattern)), "zeros of the joints, which are set by hand:");
            self.page.line("prior = 1.0", "within a degree");
        }
        Ok(())
    }

    fn frames(&mut self) {
        let known = self.known;
        let tip = known.of_role(Role::Tip);
        let sensor = tip.is_some() || known.markers().any(|(_, _, cast)| cast.sure);
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
        } else if !known.arm.is_urdf() && tip.is_none() {
            self.page.line("pose = \"given\"", "the last row of the table ends at the tool point");
        } else {
            self.page.line(
                "pose = \"estimated\"",
                if tip.is_some() {
                    "where the body sits on the last link"
                } else {
                    "where the tool point is on the last link"
                },
            );
            if let Some(at_m) = tip.and_then(|t| self.tip_at_m(t, last)) {
                let at: Vec<String> = at_m.iter().map(|x| number(*x, 3)).collect();
                self.page.line(
                    &format!("at = {{ xyz_m = [{}] }}", at.join(", ")),
                    "where the nominal arm would have it: a start",
                );
            }
        }
        if sensor && !bases.is_empty() && lean(&bases) > LEANS_RAD {
            let lean_deg = lean(&bases).to_degrees();
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

    fn holdout(&mut self) {
        let known = self.known;
        let (recordings, pauses) = (known.read.recordings.len(), known.pauses());
        let cavities = known
            .sockets
            .as_ref()
            .map(|s| s.board.cavities.len())
            .or(known.board.map(|(_, b)| b.cavities.len()));
        self.page.section("[holdout]");
        match cavities {
            Some(few) if few <= FEW_SOCKETS && recordings > 1 => {
                self.page.line(
                    "kind = \"each-recording\"",
                    &format!("{few} places cannot be parted: one placement left out in turn"),
                );
            }
            Some(few) if few <= FEW_SOCKETS => {
                self.page.line(
                    "kind = \"random\"",
                    &format!("{few} places and one recording cannot be parted: some postures are left out"),
                );
                self.page.line("share = 0.2", "");
                self.page.line("seed = 1", "");
            }
            Some(_) => {
                self.page.line(
                    "kind = \"cavity-folds\"",
                    "a fifth of the cavities held out, in turn: each is predicted once, unseen",
                );
                self.page.line("k = 5", "");
            }
            None => {
                self.page.line(
                    "kind = \"cavity-folds\"",
                    "without a table every pose is a group of its own: each is predicted once",
                );
                let k = if pauses >= 100 { 10 } else { 5.min(pauses / 2) };
                self.page.line(&format!("k = {k}"), &format!("of {pauses} pauses"));
            }
        }
    }

    /// Notes a file that goes beside the pipeline, named after it.
    fn beside(&mut self, ending: &str, text: String) -> PathBuf {
        let stem = self.known.asked.out.file_stem().unwrap_or_default().to_string_lossy();
        let path = self.folder.join(format!("{stem}{ending}"));
        self.beside.push((path.clone(), text));
        path
    }
}

fn rate(report: Option<&StreamReport>) -> String {
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

fn shown(body: &BodyTopic) -> String {
    body.body.as_ref().map_or_else(|| body.topic.clone(), |name| format!("{name} of {}", body.topic))
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

/// Patterns of the parameters that are the zeros of the joints: rotations of their origins about their own axes.
fn zeros(model: &Model) -> Result<Vec<String>, Error> {
    let skeleton = model.skeleton(0, &model.nominal(), "base");
    let along = |moving: &Moving| {
        ["rx", "ry", "rz"]
            .into_iter()
            .zip(moving.axis.iter())
            .find(|(_, x)| x.abs() > 0.999)
            .map(|(name, _)| name)
    };
    let turning = skeleton.joints.iter().filter_map(|joint| {
        let moving = joint
            .moves
            .as_ref()
            .filter(|m| m.motion == armcal_model::Motion::Revolute && m.follows.is_none())?;
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

fn sockets_toml(sockets: &Sockets) -> String {
    let mut page = Page::default();
    page.note("armcal.board/1, proposed by `armcal init`: places that the tip came back to, in the order of their first visit.");
    page.note("Distances are those at which the calibration errs least; put the drawing's in their place.");
    page.line("name = \"sockets\"", "");
    let mm = |m: f64| number(m * 1e3, 3);
    page.line(
        &format!("cavity_sigma_mm = {}", mm(sockets.board.cavity_sigma_m)),
        "assumed: tolerance of a socket's position, per axis",
    );
    page.line(
        &format!("seat_sigma_mm = {}", mm(sockets.board.seat_sigma_m)),
        "assumed: clearance of the tip in a socket, per visit and axis",
    );
    for (cavity, visits) in sockets.board.cavities.iter().zip(&sockets.visits) {
        page.section("[[cavities]]");
        page.line(&format!("name = {}", quoted(&cavity.name)), "");
        let at: Vec<String> = cavity.in_board_m.iter().map(|m| number(m * 1e3, 2)).collect();
        page.line(&format!("xyz_mm = [{}]", at.join(", ")), &format!("{visits} pauses"));
    }
    page.text()
}
