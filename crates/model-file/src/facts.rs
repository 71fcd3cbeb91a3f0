//! Arms and frames as the file has them.

use armcal_core::Pose;
use armcal_model::{Chain, Frame, Marker, Masses, ModelError};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// The file of a nominal arm, or the files of several.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "form", rename_all = "lowercase")]
pub enum ChainText {
    /// A DH table.
    Dh {
        /// The file.
        text: String,
    },
    /// A URDF.
    Urdf {
        /// The file.
        text: String,
        /// Where the arm begins.
        base_link: String,
        /// Where it ends.
        tip_link: String,
        /// Where the masses of its links come from.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        masses: Option<Masses>,
    },
    /// Several arms.
    Arms {
        /// Each by itself.
        arms: Vec<ArmText>,
    },
}

/// One of several arms.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ArmText {
    /// Its name, before those of its joints.
    pub name: String,
    /// Its file.
    pub chain: ChainText,
}

/// A frame before the fit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FrameFacts {
    /// Its name, before those of its parameters.
    pub name: String,
    /// Position [m].
    pub xyz_m: [f64; 3],
    /// Orientation.
    pub quaternion_xyzw: [f64; 4],
    /// Whether its orientation has parameters.
    pub free_rotation: bool,
}

/// A marker and the link that it is on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MarkerFacts {
    /// The link.
    pub link: String,
    /// Where on it.
    #[serde(flatten)]
    pub frame: FrameFacts,
}

/// A point or a plane that stands in the world.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PlaceFacts {
    /// Whether it is a plane.
    pub is_plane: bool,
    /// Where it stands.
    #[serde(flatten)]
    pub frame: FrameFacts,
}

/// A length before the fit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LengthFacts {
    /// What has it.
    pub name: String,
    /// The length [m].
    pub length_m: f64,
}

impl ChainText {
    /// The arm, or arms, that the text is of, with the branches to what is measured.
    pub(crate) fn chain(&self, measured: &[&str], path: &Path) -> Result<Chain, ModelError> {
        match self {
            ChainText::Dh { text } => Chain::from_dh_toml(text, path),
            ChainText::Urdf { text, base_link, tip_link, masses } => {
                let chain = Chain::from_urdf_branches(text, base_link, tip_link, measured, path)?;
                chain.with_masses(*masses, path)
            }
            ChainText::Arms { arms } => {
                let chains = arms.iter().map(|arm| Ok((arm.name.clone(), arm.chain.chain(measured, path)?)));
                Chain::joined(chains.collect::<Result<Vec<_>, ModelError>>()?)
            }
        }
    }
}

impl MarkerFacts {
    pub(crate) fn marker(&self) -> Marker {
        Marker { link: self.link.clone(), frame: self.frame.frame() }
    }
}

impl FrameFacts {
    /// A frame of that name at this pose.
    pub fn at(name: &str, pose: &Pose, free_rotation: bool) -> FrameFacts {
        let q = pose.rotation.coords;
        FrameFacts {
            name: name.to_owned(),
            xyz_m: pose.translation.vector.into(),
            quaternion_xyzw: [q.x, q.y, q.z, q.w],
            free_rotation,
        }
    }

    pub(crate) fn frame(&self) -> Frame {
        let [x, y, z, w] = self.quaternion_xyzw;
        let rotation = UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z));
        let pose = Pose::from_parts(Vector3::from(self.xyz_m).into(), rotation);
        Frame { free_rotation: self.free_rotation, ..Frame::given(self.name.clone(), pose) }
    }
}
