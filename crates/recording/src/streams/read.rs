//! The streams of a pipeline, read into columns.

use crate::recording::file::RecordingFile;
use crate::streams::field_of;
use crate::streams::gather::{Gathered, gather_streams};
use crate::streams::joints;
use crate::streams::poses;
use crate::streams::reading::{Columns, Reading};
use crate::streams::request::{Kind, Request};
use crate::streams::together;
use crate::{Chain, LengthUnit, PoseStream, Recording, RecordingError, StreamReport, Streams, Transforms};
use armcal_core::{Samples, Warning};
use rayon::prelude::*;
use std::collections::BTreeMap;

impl Recording {
    /// Reads the wanted streams: one pass over the recording, only wanted channels decoded, chunks in parallel, the
    /// result independent of chunking, compression and number of threads.
    ///
    /// Each stream comes out strictly increasing in time on its own clock, in SI units, without NaN, without occluded
    /// poses; what was dropped is counted in its [`StreamReport`] and said in the warnings. Warnings about the files
    /// themselves are in [`Recording::report`].
    ///
    /// # Errors
    /// A missing topic, joint or body (the nearest present one is named), a topic that cannot be decoded, a stream
    /// without a usable row, numbers that cannot be in the declared unit, a clock the stream does not have.
    pub fn read(
        &self,
        streams: &Streams,
    ) -> Result<(Samples, Vec<StreamReport>, Vec<Warning>), RecordingError> {
        let read = self.read_streams(streams);
        // Of a file that became shorter anything may be missing, and for any reason.
        self.files.iter().try_for_each(RecordingFile::unshortened)?;
        read
    }

    fn read_streams(
        &self,
        streams: &Streams,
    ) -> Result<(Samples, Vec<StreamReport>, Vec<Warning>), RecordingError> {
        streams.joints.iter().chain(&streams.set_points).try_for_each(joints::check_config)?;
        let named = [("tip", &streams.tip), ("base", &streams.base), ("table", &streams.table)];
        let named = named.into_iter().filter_map(|(role, stream)| Some((role, stream.as_ref()?)));
        named.chain(streams.bodies.values().map(|s| ("bodies", s))).try_for_each(poses::check_config)?;
        let requests = stream_requests(streams);
        let mut gathered = gather_streams(self, &requests)?;
        let chains = self.chains(&requests, &mut gathered)?;
        let read = |((place, request), gathered): ((usize, &Request<'_>), Gathered)| {
            let mut stage = Reading::new(request, gathered, chains.get(&place));
            let columns = stage.columns(request, place, streams)?;
            Ok((columns, stage.report, stage.warnings))
        };
        let streams_read =
            requests.par_iter().enumerate().zip(gathered).map(read).collect::<Vec<Result<_, _>>>();
        let (mut samples, mut reports, mut warnings) = (Samples::default(), Vec::new(), Vec::new());
        let mut joints = Vec::new();
        for (request, read) in requests.iter().zip(streams_read) {
            let (columns, report, said) = read?;
            reports.push(report);
            warnings.extend(said);
            let name = request.name.map(str::to_owned);
            match (request.role, columns) {
                ("joints", Columns::Joints(read)) => joints.extend(read),
                (_, Columns::Joints(read)) => samples.set_points = read,
                ("temperature", Columns::Scalars(read)) => samples.temperature = read,
                (_, Columns::Scalars(read)) => samples.gauges.extend(name.zip(read)),
                ("tip", Columns::Poses(read)) => samples.tip = read,
                ("base", Columns::Poses(read)) => samples.base = read,
                ("table", Columns::Poses(read)) => samples.table = read,
                (_, Columns::Poses(read)) => samples.bodies.extend(name.zip(read)),
            }
        }
        samples.joints = together::as_one(&streams.joints, joints)?;
        Ok((samples, reports, warnings))
    }

    /// Where a body never is in the frame that was asked for: the chain of transforms that leads from one to the other, and in
    /// the place of what was gathered the transform in it that moves.
    fn chains(
        &self,
        requests: &[Request<'_>],
        gathered: &mut [Gathered],
    ) -> Result<BTreeMap<usize, Chain>, RecordingError> {
        // One pass for the tree of all bodies on a topic, and one for all transforms that move.
        let mut trees: Vec<((&str, LengthUnit), Transforms)> = Vec::new();
        let mut found: Vec<(usize, LengthUnit, Chain)> = Vec::new();
        for (place, (request, gathered)) in requests.iter().zip(&*gathered).enumerate() {
            let Kind::Pose { body: Some(body), frame: Some(frame), unit } = request.kind else { continue };
            if !gathered.poses.seen.is_empty() || gathered.messages == 0 || !request.fields.is_empty() {
                continue;
            }
            let of = (request.topic, unit);
            if trees.iter().all(|(known, _)| *known != of) {
                trees.extend(self.transforms(&[request.topic], unit)?.into_iter().map(|tree| (of, tree)));
            }
            let tree = trees.iter().find(|(known, _)| *known == of);
            let chain = tree.map_or(Ok(None), |(_, tree)| tree.chain(frame, body));
            let chain = chain.map_err(|why| poses::no_chain(request, why))?;
            found.extend(chain.map(|chain| (place, unit, chain)));
        }
        if found.is_empty() {
            return Ok(BTreeMap::new());
        }
        let mut moving = Vec::new();
        for (place, unit, chain) in &found {
            let (topic, parent, child) = &chain.moving;
            let kind = Kind::Pose { body: Some(child), frame: Some(parent), unit: *unit };
            moving.push(Request { topic, kind, ..requests[*place].clone() });
        }
        for ((place, ..), moving) in found.iter().zip(gather_streams(self, &moving)?) {
            gathered[*place] = moving;
        }
        Ok(found.into_iter().map(|(place, _, chain)| (place, chain)).collect())
    }
}

fn stream_requests(streams: &Streams) -> Vec<Request<'_>> {
    let joints = streams.joints.iter().map(|s| ("joints", s));
    let joints = joints.chain(streams.set_points.iter().map(|s| ("set_points", s)));
    let mut requests: Vec<Request<'_>> = joints
        .map(|(role, s)| Request {
            role,
            name: None,
            topic: &s.topic,
            kind: Kind::Joints { wanted: &s.names },
            fields: s.fields(),
        })
        .collect();
    for (role, stream) in [("tip", &streams.tip), ("base", &streams.base), ("table", &streams.table)] {
        requests.extend(stream.iter().map(|s| pose_request(role, None, s)));
    }
    requests.extend(streams.bodies.iter().map(|(name, s)| pose_request("bodies", Some(name), s)));
    let scalar =
        |role, name, topic, value| Request { role, name, topic, kind: Kind::Scalar, fields: field_of(value) };
    requests
        .extend(streams.temperature.iter().map(|s| scalar("temperature", None, s.topic.as_str(), &s.value)));
    let gauges = streams.gauges.iter();
    requests.extend(gauges.map(|(name, s)| scalar("gauges", Some(name.as_str()), &s.topic, &s.value)));
    requests
}

fn pose_request<'a>(role: &'static str, name: Option<&'a str>, s: &'a PoseStream) -> Request<'a> {
    let kind = Kind::Pose { body: s.body.as_deref(), frame: s.frame.as_deref(), unit: s.unit };
    Request { role, name, topic: &s.topic, kind, fields: s.fields() }
}
