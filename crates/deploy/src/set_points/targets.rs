//! Targets from a file: CSV with a header, or TOML with `[[targets]]`.
//!
//! ```text
//! name, x_m, y_m, z_m            # and, where wanted: qx, qy, qz, qw, t_s
//! ```

use crate::error::DeployError;
use armcal_config::read_text;
use armcal_recording::input::Kind;
use nalgebra::{Quaternion, UnitQuaternion};
use serde::Deserialize;
use std::path::Path;

/// A target as written.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Wanted {
    /// Its name; `target1`, ... where none is given.
    #[serde(default)]
    pub name: String,
    /// Position [m], in the frame of the command line.
    pub xyz_m: [f64; 3],
    /// Orientation of the tip, of arms with six joints or more; any length but zero.
    pub quaternion_xyzw: Option<[f64; 4]>,
    /// When the tip should be there [s]; in every target (a path) or in none (stops).
    pub t_s: Option<f64>,
}

impl Wanted {
    /// The orientation as a rotation.
    pub fn orientation(&self) -> Option<UnitQuaternion<f64>> {
        let [x, y, z, w] = self.quaternion_xyzw?;
        Some(UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z)))
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    targets: Vec<Wanted>,
}

/// Reads and checks the file.
pub fn read(path: &Path) -> Result<Vec<Wanted>, DeployError> {
    let text = read_text("file of targets", Kind::Data, path)?;
    let bad = |problem: String| DeployError::BadTargets { path: path.to_owned(), problem };
    let toml = path.extension().is_some_and(|e| e == "toml");
    let parsed = if toml {
        toml::from_str::<File>(&text).map(|file| file.targets).map_err(|e| e.to_string())
    } else {
        from_csv(&text)
    };
    let mut targets = parsed.map_err(bad)?;
    check_targets(&targets).map_err(bad)?;
    for (i, target) in targets.iter_mut().enumerate().filter(|(_, t)| t.name.is_empty()) {
        target.name = format!("target{}", i + 1);
    }
    Ok(targets)
}

fn from_csv(text: &str) -> Result<Vec<Wanted>, String> {
    const KNOWN: [&str; 9] = ["name", "x_m", "y_m", "z_m", "qx", "qy", "qz", "qw", "t_s"];
    let mut reader =
        csv::ReaderBuilder::new().trim(csv::Trim::All).comment(Some(b'#')).from_reader(text.as_bytes());
    let header = reader.headers().map_err(|e| e.to_string())?.clone();
    if let Some(unknown) = header.iter().find(|column| !KNOWN.contains(column)) {
        return Err(format!("there is no column `{unknown}`; the columns are {}", KNOWN.join(", ")));
    }
    let find = |name: &str| header.iter().position(|column| column == name);
    let need = |name: &str| find(name).ok_or_else(|| format!("the column `{name}` is missing"));
    let position = [need("x_m")?, need("y_m")?, need("z_m")?];
    let turn = ["qx", "qy", "qz", "qw"].map(find);
    let (name, time) = (find("name"), find("t_s"));
    let mut targets = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|e| e.to_string())?;
        let line = record.position().map_or(0, csv::Position::line);
        let cell = |column: usize| record.get(column).unwrap_or_default();
        let number = |column: usize| {
            let text = cell(column);
            text.parse::<f64>().map_err(|_| format!("line {line}: `{text}` is not a number"))
        };
        let optional =
            |column: Option<usize>| column.filter(|c| !cell(*c).is_empty()).map(number).transpose();
        let q = [optional(turn[0])?, optional(turn[1])?, optional(turn[2])?, optional(turn[3])?];
        let quaternion_xyzw = match q {
            [Some(x), Some(y), Some(z), Some(w)] => Some([x, y, z, w]),
            [None, None, None, None] => None,
            _ => return Err(format!("line {line}: an orientation needs all of qx, qy, qz, qw")),
        };
        targets.push(Wanted {
            name: name.map(cell).unwrap_or_default().to_owned(),
            xyz_m: [number(position[0])?, number(position[1])?, number(position[2])?],
            quaternion_xyzw,
            t_s: optional(time)?,
        });
    }
    Ok(targets)
}

fn check_targets(targets: &[Wanted]) -> Result<(), String> {
    for (i, target) in targets.iter().enumerate() {
        let row = i + 1;
        let length = target.quaternion_xyzw.map_or(1.0, |q| q.iter().map(|v| v * v).sum::<f64>());
        if !(length.is_finite() && length > 1e-12) {
            return Err(format!("target {row}: the quaternion has no direction"));
        }
        if !target.xyz_m.iter().chain(&target.t_s).all(|v| v.is_finite()) {
            return Err(format!("target {row}: a coordinate or the time is not a finite number"));
        }
    }
    let timed = targets.iter().filter(|t| t.t_s.is_some()).count();
    if timed > 0 && timed < targets.len() {
        return Err("t_s is given for some targets only: give it to all (a path) or to none (stops)".into());
    }
    let times: Vec<f64> = targets.iter().filter_map(|t| t.t_s).collect();
    match times.windows(2).position(|t| t[1] <= t[0]) {
        Some(i) => Err(format!("target {}: its time is not later than that of the one before", i + 2)),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read_as(name: &str, text: &str) -> Result<Vec<Wanted>, String> {
        let folder = tempfile::tempdir().map_err(|e| e.to_string())?;
        let path = folder.path().join(name);
        std::fs::write(&path, text).map_err(|e| e.to_string())?;
        read(&path).map_err(|e| e.to_string())
    }

    #[test]
    fn csv_and_toml_say_the_same() {
        let csv = "name, x_m, y_m, z_m, t_s\n a, 0.4, -0.1, 0.2, 0.0\n , 0.5, 0, 0.25, 1.5\n";
        let toml = "[[targets]]\nname = 'a'\nxyz_m = [0.4, -0.1, 0.2]\nt_s = 0.0\n\
                    [[targets]]\nxyz_m = [0.5, 0.0, 0.25]\nt_s = 1.5\n";
        assert_eq!(read_as("t.csv", csv), read_as("t.toml", toml));
        assert_eq!(read_as("t.csv", csv).map(|t| t[1].name.clone()), Ok("target2".into()));
    }

    #[test]
    fn what_is_wrong_is_named() {
        for (text, says) in [
            ("x_m,y_m\n1,2\n", "`z_m` is missing"),
            ("x_m,y_m,z_mm\n1,2,3\n", "`z_mm`"),
            ("x_m,y_m,z_m\n1,2,up\n", "line 2"),
            ("x_m,y_m,z_m\n1,2,nan\n", "target 1"),
            ("x_m,y_m,z_m,t_s\n1,2,3,0\n1,2,3,\n", "some targets only"),
            ("x_m,y_m,z_m,t_s\n1,2,3,1\n1,2,3,1\n", "target 2"),
            ("x_m,y_m,z_m,qx,qy,qz,qw\n1,2,3,0,0,0,0\n", "no direction"),
            ("x_m,y_m,z_m,qx,qy,qz,qw\n1,2,3,0,0,,1\n", "all of qx"),
        ] {
            let words = read_as("t.csv", text).expect_err("a fault");
            assert!(words.contains(says) && words.contains("t.csv"), "{words}");
        }
    }
}
