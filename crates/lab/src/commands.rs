//! Set-points from a file: what somebody else's controller would be told, recording by recording.
//!
//! The lab takes them as they are. It knows nothing of how they were computed.

use crate::LabError;
use crate::config::{LabConfig, SetPointsConfig};
use armcal_recording::input;
use std::path::Path;

/// The set-points of one recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Commands {
    /// Name of the recording.
    pub recording: String,
    /// Times since the first [s]; `None`: the arm stops at each.
    pub time_s: Option<Vec<f64>>,
    /// One row a set-point [rad].
    pub joint_rad: Vec<Vec<f64>>,
    /// Pause at each stop, or at both ends of a path [s].
    pub hold_s: f64,
    /// Speed of the joint that goes furthest, between stops [rad/s].
    pub speed_rad_s: f64,
}

impl Commands {
    /// Reads the files of all recordings that are told what to do.
    pub fn load_all(config: &LabConfig, base_dir: &Path) -> Result<Vec<Commands>, LabError> {
        config.task.set_points.iter().map(|told| Commands::load(config, told, base_dir)).collect()
    }

    fn load(config: &LabConfig, told: &SetPointsConfig, base_dir: &Path) -> Result<Commands, LabError> {
        let path = base_dir.join(&told.file);
        let failed = |why: String| LabError::SetPoints { path: path.clone(), why };
        let text = input::read_to_string(&path, input::Kind::Data).map_err(|e| failed(e.to_string()))?;
        let mut options = csv::ReaderBuilder::new();
        let mut reader = options.trim(csv::Trim::All).comment(Some(b'#')).from_reader(text.as_bytes());
        let header = reader.headers().map_err(|e| failed(e.to_string()))?.clone();
        let find = |name: &str| header.iter().position(|column| column == name);
        let columns = config.joints.names.iter().map(|joint| {
            let name = format!("{}.{joint}_rad", told.columns);
            find(&name)
                .ok_or_else(|| failed(format!("it has no column `{name}`; set `columns` to its prefix")))
        });
        let columns = columns.collect::<Result<Vec<usize>, LabError>>()?;
        let time = find("t_s");
        let (mut times, mut joint_rad): (Vec<Option<f64>>, Vec<Vec<f64>>) = (Vec::new(), Vec::new());
        for record in reader.records() {
            let record = record.map_err(|e| failed(e.to_string()))?;
            let line = record.position().map_or(0, csv::Position::line);
            let number = |column: usize| match record.get(column).unwrap_or_default() {
                "" => Ok(None),
                text => match text.parse::<f64>() {
                    Ok(value) if value.is_finite() => Ok(Some(value)),
                    _ => Err(failed(format!("line {line}: `{text}` is not a finite number"))),
                },
            };
            let row = columns
                .iter()
                .map(|c| number(*c)?.ok_or_else(|| failed(format!("line {line}: a joint has no set-point"))));
            joint_rad.push(row.collect::<Result<Vec<f64>, LabError>>()?);
            times.push(time.map(number).transpose()?.flatten());
        }
        if joint_rad.is_empty() {
            return Err(failed("it has no rows".into()));
        }
        Ok(Commands {
            recording: told.recording.clone(),
            time_s: path_times(&times).map_err(failed)?,
            joint_rad,
            hold_s: told.hold_s,
            speed_rad_s: told.speed_deg_s.to_radians(),
        })
    }
}

/// Times of a path since its first row; `None` where there are none.
fn path_times(times: &[Option<f64>]) -> Result<Option<Vec<f64>>, String> {
    // One row is a stop, whatever its time.
    if times.len() < 2 || times.iter().all(Option::is_none) {
        return Ok(None);
    }
    let all: Vec<f64> = times.iter().flatten().copied().collect();
    if all.len() < times.len() {
        return Err("t_s is given in some rows only; give it in all or in none".into());
    }
    if !all.windows(2).all(|t| t[1] > t[0]) {
        return Err("t_s does not rise from row to row".into());
    }
    if all[all.len() - 1] - all[0] > 3600.0 {
        return Err("t_s spans more than an hour".into());
    }
    Ok(Some(all.iter().map(|t| t - all[0]).collect()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn load(text: &str) -> Result<Vec<Commands>, String> {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("set-points.csv"), text).unwrap();
        let lab = "name = 'x'\nseed = 1\n[board]\nfile = 'b.toml'\n[[recordings]]\nname = 'driven'\n\
                   [[task.set_points]]\nrecording = 'driven'\nfile = 'set-points.csv'\n";
        let config = LabConfig::from_toml(lab, Path::new("lab.toml")).unwrap();
        Commands::load_all(&config, folder.path()).map_err(|e| e.to_string())
    }

    #[test]
    fn columns_are_found_by_name_and_times_decide_what_it_is() {
        let head = "name,set_point.joint2_rad,set_point.joint1_rad,t_s,set_point.joint3_rad\n";
        let stops = load(&format!("{head}a,0.2,0.1,,0.3\nb,0.5,0.4,,0.6\n")).unwrap();
        assert_eq!(stops[0].joint_rad, [[0.1, 0.2, 0.3], [0.4, 0.5, 0.6]]);
        assert_eq!(stops[0].time_s, None);
        let path = load(&format!("{head}a,0.2,0.1,3.0,0.3\nb,0.5,0.4,3.5,0.6\n")).unwrap();
        assert_eq!(path[0].time_s, Some(vec![0.0, 0.5]));
    }

    #[test]
    fn what_is_wrong_is_named() {
        let head = "set_point.joint1_rad,set_point.joint2_rad,set_point.joint3_rad,t_s\n";
        for (rows, says) in [
            ("0,0,x,\n", "line 2"),
            ("0,0,,\n", "no set-point"),
            ("0,0,0,1\n0,0,0,\n", "some rows"),
            ("0,0,0,1\n0,0,0,1\n", "rise"),
            ("", "no rows"),
        ] {
            let words = load(&format!("{head}{rows}")).unwrap_err();
            assert!(words.contains(says) && words.contains("set-points.csv"), "{words}");
        }
        assert!(load("a,b\n1,2\n").unwrap_err().contains("set_point.joint1_rad"));
    }
}
