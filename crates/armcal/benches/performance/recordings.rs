//! Recordings to read: what a rig with a tracker and a camera leaves behind, by seed, of any size.

use crate::Result;
use armcal_recording::output::McapOutput;
use armcal_recording::ros2::{self, Header};
use rand::{Rng as _, RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use std::collections::BTreeMap;
use std::path::Path;

/// Topics of the two streams that are read.
pub const JOINTS: &str = "/joint_states";
/// The tracked tip.
pub const TIP: &str = "/vicon/tip/tip";
/// Joints of the arm.
pub const JOINT_NAMES: [&str; 3] = ["joint1", "joint2", "joint3"];

/// A camera image as JPEG, 1280 x 720 [bytes]. Its bytes are random: a JPEG does not compress either.
const IMAGE_BYTES: usize = 110_000;
const START_NS: i64 = 1_760_000_000_000_000_000;
const MILLISECOND_NS: i64 = 1_000_000;
/// A camera takes an image every so many milliseconds.
const IMAGE_EVERY_MS: i64 = 33;
/// Share of such a recording that is images; the streams are the rest.
const IMAGE_SHARE: f64 = 0.96;

const COMPRESSED_IMAGE: ros2::Schema = ros2::Schema {
    name: "sensor_msgs/msg/CompressedImage",
    text: concat!(
        "std_msgs/Header header\n",
        "string format\n",
        "uint8[] data\n",
        "================================================================================\n",
        "MSG: std_msgs/Header\n",
        "builtin_interfaces/Time stamp\n",
        "string frame_id\n",
        "================================================================================\n",
        "MSG: builtin_interfaces/Time\n",
        "int32 sec\n",
        "uint32 nanosec\n",
    ),
};

/// Writes a recording of about `bytes`: joint states at 1 kHz, the tip at 250 Hz, images at 30 Hz, in chunks of 1 MiB
/// by zstd. An existing file is kept: the name must say everything that went into it.
pub fn streams(path: &Path, bytes: u64, seed: u64) -> Result<()> {
    if path.exists() {
        return Ok(());
    }
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut out = McapOutput::create(path, "ros2")?;
    let mut channels = BTreeMap::new();
    for (topic, schema) in [(JOINTS, &ros2::JOINT_STATE), (TIP, &ros2::POSE_STAMPED)] {
        channels.insert(topic, channel(&mut out, topic, schema)?);
    }
    let mut camera = Camera::new(&mut out)?;
    let mut tick = 0;
    while (camera.bytes as f64) < IMAGE_SHARE * bytes as f64 {
        let stamp_ns = START_NS + tick * MILLISECOND_NS + random.random_range(0..20_000);
        let log_ns = |late_ns: i64| stamp_ns + late_ns;
        let joints = joint_state(stamp_ns, tick, &mut random);
        put(&mut out, channels[JOINTS], tick as u32, stamp_ns, log_ns(150_000), &joints)?;
        if tick % 4 == 0 {
            let tip = tip_pose(stamp_ns, tick, &mut random);
            put(&mut out, channels[TIP], (tick / 4) as u32, stamp_ns, log_ns(400_000), &tip)?;
        }
        if tick % IMAGE_EVERY_MS == 0 {
            camera.take(&mut out, stamp_ns, &mut random)?;
        }
        tick += 1;
    }
    Ok(out.finish()?)
}

/// Writes the recording `source` with as many images between its messages as make it about `bytes` large.
pub fn with_camera(source: &Path, path: &Path, bytes: u64, seed: u64) -> Result<()> {
    if path.exists() {
        return Ok(());
    }
    let whole = std::fs::read(source)?;
    let messages = mcap::MessageStream::new(&whole)?.collect::<mcap::McapResult<Vec<_>>>()?;
    let (first_ns, last_ns) = match messages.as_slice() {
        [first, .., last] => (first.log_time as i64, last.log_time as i64),
        _ => return Err(format!("{} holds no recording", source.display()).into()),
    };
    let images = bytes.saturating_sub(whole.len() as u64) / IMAGE_BYTES as u64;
    let every_ns = (last_ns - first_ns) / (images as i64).max(1);
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut out = McapOutput::create(path, "ros2")?;
    let mut camera = Camera::new(&mut out)?;
    for message in &messages {
        let due = (message.log_time as i64 - first_ns) / every_ns;
        while images > 0 && i64::from(camera.taken) <= due {
            camera.take(&mut out, message.log_time as i64 - 1_000_000, &mut random)?;
        }
        let about = &message.channel;
        let schema = about.schema.as_ref().map(|s| (s.name.as_str(), s.encoding.as_str(), &*s.data));
        let id = out.add_channel(&about.topic, schema, &about.message_encoding, &about.metadata)?;
        out.put(id, message.sequence, message.log_time, message.publish_time, &message.data)?;
    }
    Ok(out.finish()?)
}

/// A camera that publishes JPEGs.
struct Camera {
    channel: u16,
    taken: u32,
    bytes: u64,
}

impl Camera {
    fn new(out: &mut McapOutput) -> Result<Camera> {
        let topic = "/camera/image_raw/compressed";
        Ok(Camera { channel: channel(out, topic, &COMPRESSED_IMAGE)?, taken: 0, bytes: 0 })
    }

    fn take(&mut self, out: &mut McapOutput, stamp_ns: i64, random: &mut ChaCha8Rng) -> Result<()> {
        // Encapsulation, stamp, "camera", "jpeg", the image: CDR, little-endian, aligned by hand.
        let mut image = vec![0, 1, 0, 0];
        image.extend(((stamp_ns / 1_000_000_000) as i32).to_le_bytes());
        image.extend(((stamp_ns % 1_000_000_000) as u32).to_le_bytes());
        image.extend(7_u32.to_le_bytes());
        image.extend(b"camera\0\0");
        image.extend(5_u32.to_le_bytes());
        image.extend(b"jpeg\0\0\0\0");
        image.extend((IMAGE_BYTES as u32).to_le_bytes());
        let at = image.len();
        image.resize(at + IMAGE_BYTES, 0);
        random.fill_bytes(&mut image[at..]);
        put(out, self.channel, self.taken, stamp_ns, stamp_ns + 800_000, &image)?;
        (self.taken, self.bytes) = (self.taken + 1, self.bytes + image.len() as u64);
        Ok(())
    }
}

fn channel(out: &mut McapOutput, topic: &str, schema: &ros2::Schema) -> Result<u16> {
    let schema = (schema.name, ros2::SCHEMA_ENCODING, schema.text.as_bytes());
    Ok(out.add_channel(topic, Some(schema), ros2::MESSAGE_ENCODING, &BTreeMap::new())?)
}

fn put(
    out: &mut McapOutput,
    channel: u16,
    sequence: u32,
    stamp_ns: i64,
    log_ns: i64,
    data: &[u8],
) -> Result<()> {
    Ok(out.put(channel, sequence, log_ns as u64, stamp_ns as u64, data)?)
}

/// Joints that swing, read by 16-bit encoders, their speeds by differences, their efforts with noise.
fn joint_state(stamp_ns: i64, tick: i64, random: &mut ChaCha8Rng) -> Vec<u8> {
    let time_s = tick as f64 * 1e-3;
    let step_rad = std::f64::consts::TAU / 65536.0;
    let angle = |k: f64, time_s: f64| (0.3 + 0.2 * k) * ((0.4 + 0.1 * k) * time_s + k).sin();
    let counted = |k: f64, time_s: f64| (angle(k, time_s) / step_rad).round() * step_rad;
    let joints = [0.0, 1.0, 2.0];
    let position = joints.map(|k| counted(k, time_s));
    let velocity = joints.map(|k| (counted(k, time_s) - counted(k, time_s - 0.01)) / 0.01);
    let effort = joints.map(|k| 2.0 * angle(k, time_s).cos() + random.random_range(-0.05..0.05));
    let header = Header { stamp_ns, frame_id: "" };
    ros2::joint_state(header, &JOINT_NAMES, &position, &velocity, &effort)
}

/// A tip that goes round, seen with a tracker's noise.
fn tip_pose(stamp_ns: i64, tick: i64, random: &mut ChaCha8Rng) -> Vec<u8> {
    let time_s = tick as f64 * 1e-3;
    let mut noise_m = || random.random_range(-2e-4..2e-4);
    let position_m = [
        0.35 + 0.1 * (0.4 * time_s).sin() + noise_m(),
        0.1 * (0.4 * time_s).cos() + noise_m(),
        0.4 + 0.05 * (0.3 * time_s).sin() + noise_m(),
    ];
    let (sin, cos) = (0.1 * (0.2 * time_s).sin() + noise_m()).sin_cos();
    ros2::pose_stamped(Header { stamp_ns, frame_id: "vicon" }, position_m, [0.0, sin, 0.0, cos])
}
