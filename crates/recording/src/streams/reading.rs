//! One stream on its way from rows to columns: its clock, its order, its units, and what of it is dropped.

use crate::streams::clean::{Counts, Kept, drop_duplicates, in_time_order, rate_and_gap};
use crate::streams::clock::{choose_clock, drop_stray, judge_header};
use crate::streams::gather::Gathered;
use crate::streams::joints;
use crate::streams::occlusion::{Verdict, reject_frozen, reject_unseen};
use crate::streams::poses;
use crate::streams::publishers::find_other_publisher;
use crate::streams::request::Request;
use crate::streams::sensor_time::{ClockStep, spread_bursts};
use crate::streams::temperature::{Scale, like_fahrenheit};
use crate::{
    Chain, Clock, GaugeStream, JointStream, Occlusion, PoseStream, RecordingError, ScalarStream,
    StreamReport, Streams,
};
use armcal_core::{Code, JointSamples, PoseSamples, ScalarSamples, Severity, Stage, Warning};

/// Readings of two publishers are this far apart [rad], [m].
const PUBLISHERS_APART_RAD: f64 = 0.3;
const PUBLISHERS_APART_M: f64 = 0.05;

/// What is read of one stream; `None` where it holds nothing and that is no error.
pub(crate) enum Columns {
    Joints(Option<JointSamples>),
    Poses(Option<PoseSamples>),
    Scalars(Option<ScalarSamples>),
}

/// One stream on its way from rows to columns.
pub(crate) struct Reading<'a> {
    role: &'static str,
    gathered: Gathered,
    /// What joins its rows to the frame and the body that were asked for.
    chain: Option<&'a Chain>,
    /// How far its clock is ahead of log time [s].
    ahead_of_log_s: Option<f64>,
    /// What became of its rows.
    pub report: StreamReport,
    /// What is said of them.
    pub warnings: Vec<Warning>,
}

impl Reading<'_> {
    /// Of a request, with what was gathered for it.
    pub fn new<'a>(request: &Request<'_>, gathered: Gathered, chain: Option<&'a Chain>) -> Reading<'a> {
        let report = StreamReport {
            role: request.name.map_or(request.role.to_owned(), |name| format!("{}.{name}", request.role)),
            topic: request.topic.to_owned(),
            clock: Clock::Log,
            clock_reason: String::new(),
            messages: gathered.messages,
            rows: 0,
            undecodable: gathered.undecodable,
            non_finite: 0,
            impossible: 0,
            unstamped: 0,
            stray_stamps: 0,
            duplicate_stamps: 0,
            backward_stamps: 0,
            other_joints: gathered.joints.other,
            occluded: Occlusion::default(),
            rate_hz: 0.0,
            largest_gap_s: 0.0,
            quantisation_rad: Vec::new(),
        };
        Reading { role: request.role, gathered, chain, ahead_of_log_s: None, report, warnings: Vec::new() }
    }

    /// The columns of the stream of these that stands at `place` among the requests, which begin with the joints.
    pub fn columns(
        &mut self,
        request: &Request<'_>,
        place: usize,
        streams: &Streams,
    ) -> Result<Columns, RecordingError> {
        let mut joints = |stream: Option<&JointStream>| stream.map(|s| self.joints(s)).transpose();
        Ok(match (request.role, request.name) {
            ("joints", _) => Columns::Joints(joints(streams.joints.get(place))?),
            ("set_points", _) => Columns::Joints(joints(streams.set_points.as_ref())?),
            ("temperature", _) => {
                let read = streams.temperature.as_ref().map(|s| self.temperature(s)).transpose()?;
                Columns::Scalars(read.flatten())
            }
            ("gauges", Some(name)) => {
                Columns::Scalars(streams.gauges.get(name).map(|s| self.gauge(s)).transpose()?)
            }
            (_, Some(name)) => {
                Columns::Poses(streams.bodies.get(name).map(|s| self.marker(s)).transpose()?.flatten())
            }
            (role, None) => {
                let stream = match role {
                    "tip" => &streams.tip,
                    "base" => &streams.base,
                    _ => &streams.table,
                };
                Columns::Poses(stream.as_ref().map(|s| self.poses(s)).transpose()?)
            }
        })
    }

    fn joints(&mut self, stream: &JointStream) -> Result<JointSamples, RecordingError> {
        let role = self.role;
        self.refuse_undecoded(role)?;
        let table = std::mem::take(&mut self.gathered.joints);
        if self.gathered.messages > 0 && table.position.iter().all(Vec::is_empty) {
            return Err(table.none_selected(stream, self.gathered.messages));
        }
        let finite = |i: usize| table.position.iter().all(|column| column[i].is_finite());
        let (mut rows, mut counts) = in_time_order(&self.time(role, stream.clock)?, finite);
        self.leave_other_publisher(&mut rows, PUBLISHERS_APART_RAD * stream.unit_per_rad(), |i, row| {
            row.extend(table.position.iter().map(|column| column[i]));
        });
        drop_duplicates(&mut rows, &mut counts);
        let mut joint_rad = rows.of_columns(table.position);
        joints::to_rad(&mut joint_rad, stream);
        joints::check_unit(&joint_rad, stream)?;
        if let Some(possible) = joints::possible_row_mask(&joint_rad, stream) {
            for column in &mut joint_rad {
                let mut place = 0..;
                column.retain(|_| place.next().is_some_and(|place: usize| possible[place]));
            }
            let mut place = 0..;
            self.drop_impossible(&mut rows, |_| place.next().is_some_and(|place: usize| possible[place]));
        }
        let effort_nm = joints::recorded_effort(rows.of_columns(table.effort));
        let time_ns = rows.time_ns;
        self.finish(role, &time_ns, counts)?;
        self.inadequate(Code::UnitDoubtful, joints::looks_like_radians(&joint_rad, stream));
        self.report.quantisation_rad = joints::quantisation_rad(&joint_rad);
        for (said, arm) in self.warnings.iter_mut().filter_map(|said| Some((said, stream.arm.as_ref()?))) {
            said.subject = format!("{arm}: {}", said.subject);
        }
        let ahead_of_log_s = self.ahead_of_log_s;
        let mut samples =
            JointSamples { time_ns, names: stream.names.clone(), joint_rad, effort_nm, ahead_of_log_s };
        stream.mend_readings(&mut samples);
        Ok(samples)
    }

    fn poses(&mut self, stream: &PoseStream) -> Result<PoseSamples, RecordingError> {
        let role = self.role;
        self.refuse_undecoded(role)?;
        let table = std::mem::take(&mut self.gathered.poses);
        if table.seen.is_empty() && !table.other_frames.is_empty() {
            return Err(poses::frame_missing(role, stream, &table.other_frames));
        }
        if self.gathered.messages > 0 && table.seen.is_empty() && stream.body.is_some() {
            return Err(poses::body_missing(role, stream, &self.gathered.other_bodies));
        }
        poses::check_body(role, stream, &table)?;
        let (mut rows, mut counts) = in_time_order(&self.time(role, stream.clock)?, |i| table.is_finite(i));
        if let Some(bursts) = stream.clock.is_none().then(|| spread_bursts(&mut rows.time_ns)).flatten() {
            self.say(Severity::Notice, Code::StampsInBursts, bursts.told());
        }
        poses::check_unit(role, stream, &table, &rows)?;
        self.drop_impossible(&mut rows, |i| poses::is_possible(&table.seen[i]));
        let Verdict { mut occluded, oriented } = reject_unseen(&mut rows, &table.seen);
        self.leave_other_publisher(&mut rows, PUBLISHERS_APART_M, |i, row| {
            row.extend(table.seen[i].position_m)
        });
        drop_duplicates(&mut rows, &mut counts);
        occluded.frozen = reject_frozen(&mut rows, &table.seen);
        self.report.occluded = occluded;
        let position_m = poses::positions_m(&table, &rows);
        let orientation = oriented.then(|| poses::orientations(&table, &rows)).flatten();
        let time_ns = rows.time_ns;
        self.finish(role, &time_ns, counts)?;
        self.inadequate(Code::UnitDoubtful, poses::looks_like_metres(stream, &position_m));
        let several = (table.frames.len() > 1).then(|| {
            format!(
                "poses come in several frames ({:?}) and are read as if they were one: set `frame`",
                table.frames
            )
        });
        self.inadequate(Code::SeveralFrames, several);
        let unoriented =
            table.seen.iter().filter(|s| !oriented && s.quaternion_xyzw.is_some()).count() as u64;
        let text =
            "rows have a quaternion, but not all of about unit length: the stream is read as positions only";
        self.counted(Severity::Notice, Code::OrientationUnusable, unoriented, text);
        let mut samples = PoseSamples {
            frame_id: table.frames.first().cloned().unwrap_or_default(),
            body: stream.body.clone().or_else(|| table.bodies.first().cloned()).unwrap_or_default(),
            time_ns,
            position_m,
            orientation,
            ahead_of_log_s: self.ahead_of_log_s,
        };
        let unusable = |why| RecordingError::NotDecodable { role, topic: stream.topic.clone(), why };
        if let Some(chain) = self.chain {
            self.say(Severity::Notice, Code::TransformChain, chain.told());
            samples = chain.composed(samples).map_err(unusable)?;
        }
        stream.mend_poses(&mut samples).map_err(unusable)?;
        Ok(samples)
    }

    /// None where the sensor never saw it: a marker that is hidden costs its own rows, not the recording.
    fn marker(&mut self, stream: &PoseStream) -> Result<Option<PoseSamples>, RecordingError> {
        match self.poses(stream) {
            Err(unseen @ RecordingError::NoRows { .. }) => {
                let text = format!("nothing is known of this marker here: {unseen}");
                self.say(Severity::DataLost, Code::MarkerUnseen, text);
                Ok(None)
            }
            read => read.map(Some),
        }
    }

    /// Every reading that is a number [m].
    fn gauge(&mut self, stream: &GaugeStream) -> Result<ScalarSamples, RecordingError> {
        let role = self.role;
        self.refuse_undecoded(role)?;
        let value = std::mem::take(&mut self.gathered.scalars);
        let (mut rows, mut counts) = in_time_order(&self.time(role, stream.clock)?, |i| value[i].is_finite());
        drop_duplicates(&mut rows, &mut counts);
        self.finish(role, &rows.time_ns, counts)?;
        let to_m = f64::from(stream.direction) * stream.unit.to_m();
        let value = rows.file_rows().map(|i| value[i] * to_m).collect();
        Ok(ScalarSamples { time_ns: rows.time_ns, value })
    }

    /// None where no reading can be a temperature: a thermometer that is broken costs its effects, not the recording.
    fn temperature(&mut self, stream: &ScalarStream) -> Result<Option<ScalarSamples>, RecordingError> {
        let role = "temperature";
        self.refuse_undecoded(role)?;
        let value = std::mem::take(&mut self.gathered.scalars);
        let (mut rows, mut counts) = in_time_order(&self.time(role, stream.clock)?, |i| value[i].is_finite());
        let scale = Scale::of(&rows.file_rows().map(|i| value[i]).collect::<Vec<_>>());
        self.drop_impossible(&mut rows, |i| scale.celsius(value[i]).is_some());
        drop_duplicates(&mut rows, &mut counts);
        let celsius: Vec<f64> = rows.file_rows().filter_map(|i| scale.celsius(value[i])).collect();
        let time_ns = rows.time_ns;
        if let Err(why) = self.finish(role, &time_ns, counts) {
            let mixed = match scale {
                Scale::Mixed => {
                    "some readings look like kelvin and some like degrees Celsius, so none is believed; "
                }
                _ => "",
            };
            let text = format!("{mixed}nothing here depends on temperature: {why}");
            self.say(Severity::DataLost, Code::TemperatureUnusable, text);
            return Ok(None);
        }
        if scale == Scale::Kelvin {
            let text = "looks like kelvin, every reading being one that no laboratory has in degrees Celsius: converted";
            self.say(Severity::Notice, Code::TemperatureKelvin, text.to_owned());
        } else if let Some(text) = like_fahrenheit(&celsius) {
            self.say(Severity::Notice, Code::TemperatureFahrenheit, text);
        }
        Ok(Some(ScalarSamples { time_ns, value: celsius }))
    }

    /// A stream of which nothing decodes is an error with the first reason.
    fn refuse_undecoded(&self, role: &'static str) -> Result<(), RecordingError> {
        let g = &self.gathered;
        if g.messages > 0 && g.undecodable == g.messages {
            let why = format!(
                "none of its {} messages decodes: {}",
                g.messages,
                g.first_error.as_deref().unwrap_or("")
            );
            return Err(RecordingError::NotDecodable { role, topic: self.report.topic.clone(), why });
        }
        Ok(())
    }

    /// The time of each row on the clock asked for, or on the best one.
    fn time(&mut self, role: &'static str, asked: Option<Clock>) -> Result<Vec<Option<i64>>, RecordingError> {
        let mut stamps = std::mem::take(&mut self.gathered.stamps);
        let steps = if asked.is_none() { stamps.take_out_steps() } else { Vec::new() };
        let (clock, mut why) = match asked {
            None => choose_clock(&stamps),
            Some(clock) => (clock, "set in the pipeline".to_owned()),
        };
        let stamped = stamps.header_ns.iter().flatten().any(|ns| *ns > 0);
        if clock == Clock::Header && !stamped && !stamps.log_ns.is_empty() {
            let (topic, why) = (self.report.topic.clone(), judge_header(&stamps).err().unwrap_or_default());
            let why = format!("{why}; set \"publish\" or \"log\", or remove the key");
            return Err(RecordingError::NoClock { role, topic, clock: "header", why });
        }
        let has_none = clock != Clock::Header && !matches!(role, "temperature" | "gauges");
        if asked.is_none() && has_none && stamps.header_ns.iter().all(Option::is_none) {
            let text = format!(
                "its messages carry no stamp of their own: {} time is used in its place",
                clock.word()
            );
            self.say(Severity::Notice, Code::NoStamp, text);
        }
        let doubt = match asked {
            None if clock != Clock::Header && stamped => {
                Some(format!("{why}; {} time is used in its place", clock.word()))
            }
            Some(Clock::Header) => judge_header(&stamps).err().map(|why| {
                format!("{why}, and are used as the pipeline asks: remove `clock`, or set clock = \"log\"")
            }),
            _ => None,
        };
        if let Some(doubt) = doubt {
            self.say(Severity::Notice, Code::HeaderClock, doubt);
        }
        for step in steps.iter().filter(|_| clock == Clock::Header).map(ClockStep::told) {
            let taken_out =
                "the clock was set, and the step is taken out; clock = \"log\" reads the other clock";
            self.say(Severity::Notice, Code::HeaderClock, format!("{step}: {taken_out}"));
            why += &format!("; {step}, taken out");
        }
        if clock == Clock::Header {
            self.ahead_of_log_s = stamps.ahead_of_log_s();
        }
        let mut time = stamps.on(clock);
        if clock == Clock::Header {
            self.report.stray_stamps = drop_stray(&mut time, &stamps.log_ns);
        }
        (self.report.clock, self.report.clock_reason) = (clock, why);
        Ok(time)
    }

    /// Leaves out the rows of a second publisher on the topic, given the numbers of each row of the file.
    fn leave_other_publisher(&mut self, rows: &mut Kept, apart: f64, of: impl Fn(usize, &mut Vec<f64>)) {
        let places: Vec<usize> = rows.file_rows().collect();
        let Some(other) = find_other_publisher(places.len(), |k, row| of(places[k], row), apart) else {
            return;
        };
        other.leave_out(rows);
        let severity = if other.still_at.is_some() { Severity::Notice } else { Severity::Inadequate };
        self.say(severity, Code::TwoPublishers, other.told());
    }

    /// Removes the rows of the file whose numbers are none a sensor can mean.
    fn drop_impossible(&mut self, rows: &mut Kept, mut possible: impl FnMut(usize) -> bool) {
        self.report.impossible = rows.drop_where(|_, i| !possible(i));
    }

    /// Completes the report, says what was lost, and refuses an empty stream.
    fn finish(&mut self, role: &'static str, time_ns: &[i64], counts: Counts) -> Result<(), RecordingError> {
        let r = &mut self.report;
        r.rows = time_ns.len();
        r.non_finite = counts.non_finite;
        r.unstamped = counts.unstamped.saturating_sub(r.stray_stamps);
        r.duplicate_stamps = counts.duplicate;
        r.backward_stamps = counts.backward;
        (r.rate_hz, r.largest_gap_s) = rate_and_gap(time_ns);
        let of_topic = |why: &str| RecordingError::NoRows {
            role,
            topic: r.topic.clone(),
            messages: r.messages,
            why: why.to_owned(),
        };
        if r.messages == 0 {
            return Err(of_topic("the channel is empty; name another topic, or record it again"));
        }
        if time_ns.len() == 1 && r.duplicate_stamps > 0 {
            return Err(of_topic("all of them have the same stamp; set another `clock` for this stream"));
        }
        if time_ns.is_empty() {
            let why = format!(
                "{} undecodable, {} with NaN, {} without a stamp, {} with a stray one, {} with impossible values, \
                 {} occluded; name another topic",
                r.undecodable,
                r.non_finite,
                r.unstamped,
                r.stray_stamps,
                r.impossible,
                r.occluded.total()
            );
            return Err(of_topic(&why));
        }
        self.warn_of_losses();
        Ok(())
    }

    fn warn_of_losses(&mut self) {
        let r = self.report.clone();
        let first = self.gathered.first_error.as_deref().unwrap_or("");
        let lost = Severity::DataLost;
        let note = Severity::Notice;
        self.counted(
            lost,
            Code::Undecodable,
            r.undecodable,
            &format!("messages could not be decoded, the first because: {first}"),
        );
        self.counted(lost, Code::NonFinite, r.non_finite, "rows with NaN or infinite values dropped");
        self.counted(
            lost,
            Code::Impossible,
            r.impossible,
            "rows dropped with values no joint or laboratory can have: look for damage or a faulty driver",
        );
        self.counted(
            lost,
            Code::StrayStamps,
            r.stray_stamps,
            "rows dropped whose header stamp is far from all others: look for damage or a clock that was set",
        );
        self.counted(lost, Code::Unstamped, r.unstamped, "rows without a stamp dropped");
        self.counted(
            note,
            Code::DuplicateStamps,
            r.duplicate_stamps,
            "rows with the stamp of the row before dropped",
        );
        self.counted(
            note,
            Code::BackwardStamps,
            r.backward_stamps,
            "rows with stamps going backwards sorted into place",
        );
        let of_all = format!("of {} poses rejected as occluded", r.messages);
        self.counted(note, Code::Occluded, r.occluded.total(), &of_all);
        self.counted(note, Code::OtherJoints, r.other_joints, "messages without all wanted joints skipped");
        let gathered = &self.gathered;
        let unread = gathered.unreadable.iter().map(|why| {
            (Code::ChannelUnreadable, format!("another channel of this topic is not read: {why}"))
        });
        let substituted = gathered.substituted.iter().map(|said| (Code::DefinitionSubstituted, said.clone()));
        let said: Vec<(Code, String)> = unread.chain(substituted).collect();
        said.into_iter().for_each(|(code, text)| self.say(note, code, text));
    }

    fn counted(&mut self, severity: Severity, code: Code, count: u64, what: &str) {
        if count > 0 {
            let text = format!("{count} {what}");
            self.warnings.push(Warning::new(
                severity,
                Stage::Recording,
                code,
                warning_subject(&self.report),
                text,
            ));
        }
    }

    fn inadequate(&mut self, code: Code, text: Option<String>) {
        if let Some(text) = text {
            self.say(Severity::Inadequate, code, text);
        }
    }

    fn say(&mut self, severity: Severity, code: Code, text: String) {
        self.warnings.push(Warning::new(
            severity,
            Stage::Recording,
            code,
            warning_subject(&self.report),
            text,
        ));
    }
}

fn warning_subject(report: &StreamReport) -> String {
    format!("stream {} ({})", report.role, report.topic)
}
