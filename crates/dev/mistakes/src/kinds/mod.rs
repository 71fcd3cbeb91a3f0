//! The mistakes: each takes a sound session and makes it wrong.

mod boards;
mod clocks;
mod encoders;
mod faults;
mod joints;
mod models;
mod noise;
mod poses;
mod rigging;
mod set_points;

use crate::rigs::Rig;
use crate::session::Session;
use crate::{Draw, Error};

/// One kind of mistake.
#[derive(Clone, Copy)]
pub struct Kind {
    /// Its name.
    pub name: &'static str,
    /// The cause that a right report names, of [`crate::causes`].
    pub cause: &'static str,
    /// The rigs on which it can be made.
    pub rigs: &'static [Rig],
    make: Make,
}

/// Makes a mistake in a session.
#[derive(Clone, Copy)]
enum Make {
    /// Of a part: returns words of which a report about it has to name one, such as the joint.
    Part(fn(&mut Session, &mut Draw) -> Result<Vec<String>, Error>),
    /// Of a joint, the first one or a later one, which a report has to name.
    Joint(usize, fn(&mut Session, &mut Draw, usize)),
    /// Of the whole: a report need not name anything.
    Whole(fn(&mut Session, &mut Draw)),
}

impl Kind {
    /// Makes it in a session. Returns words of which a report that is about a part has to name one; none where the report
    /// need not.
    pub fn make(&self, session: &mut Session, draw: &mut Draw) -> Result<Vec<String>, Error> {
        match self.make {
            Make::Part(make) => make(session, draw),
            Make::Joint(first, make) => {
                let joint = first + draw.pick(session.joint_names().len() - first);
                make(session, draw, joint);
                about_joints(session, &[joint])
            }
            Make::Whole(make) => {
                make(session, draw);
                about_anything()
            }
        }
    }
}

const ALL: &[Rig] = &Rig::ALL;
const SEEN: &[Rig] = &[Rig::Table, Rig::Poses];
const BOARD: &[Rig] = &[Rig::Table, Rig::Sockets];
const TABLE: &[Rig] = &[Rig::Table];
const POSES: &[Rig] = &[Rig::Poses];

const fn kind(
    name: &'static str,
    cause: &'static str,
    rigs: &'static [Rig],
    make: fn(&mut Session, &mut Draw) -> Result<Vec<String>, Error>,
) -> Kind {
    Kind { name, cause, rigs, make: Make::Part(make) }
}

/// Of a joint of any rig, drawn from the joint of this index on.
const fn joint(
    name: &'static str,
    cause: &'static str,
    first: usize,
    make: fn(&mut Session, &mut Draw, usize),
) -> Kind {
    Kind { name, cause, rigs: ALL, make: Make::Joint(first, make) }
}

const fn whole(
    name: &'static str,
    cause: &'static str,
    rigs: &'static [Rig],
    make: fn(&mut Session, &mut Draw),
) -> Kind {
    Kind { name, cause, rigs, make: Make::Whole(make) }
}

/// Every kind, in the order of the table.
pub fn kinds() -> Vec<Kind> {
    let groups = [
        joints::KINDS,
        encoders::KINDS,
        poses::KINDS,
        boards::KINDS,
        models::KINDS,
        rigging::KINDS,
        clocks::KINDS,
        faults::KINDS,
        noise::KINDS,
    ];
    groups.concat()
}

/// A kind by its name.
pub fn find_kind(name: &str) -> Result<Kind, Error> {
    kinds().into_iter().find(|kind| kind.name == name).ok_or_else(|| Error::Unknown {
        what: "kind",
        name: name.to_owned(),
        known: kinds().iter().map(|kind| kind.name).collect::<Vec<_>>().join(", "),
    })
}

/// Changes every reading of every joint by itself.
fn change_readings(session: &mut Session, change: impl Fn(f64) -> f64) {
    session.joints(|_, q| q.iter_mut().for_each(|q| *q = change(*q)));
}

/// A report may be about anything.
fn about_anything() -> Result<Vec<String>, Error> {
    Ok(Vec::new())
}

/// A report has to name one of these joints.
fn about_joints(session: &Session, joints: &[usize]) -> Result<Vec<String>, Error> {
    let names = session.joint_names();
    Ok(joints.iter().filter_map(|j| names.get(*j).cloned()).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_changes_the_session_the_same_way_each_time() {
        for rig in Rig::ALL {
            let sound = Session::sound(rig, 3, "test").unwrap();
            assert_eq!(sound, Session::sound(rig, 3, "test").unwrap(), "{rig:?} is not the same twice");
            for kind in kinds().iter().filter(|kind| kind.rigs.contains(&rig)) {
                let make = |seed| {
                    let mut session = sound.clone();
                    let about = kind.make(&mut session, &mut Draw::new(seed, kind.name, rig.word())).unwrap();
                    (session, about)
                };
                let (made, about) = make(5);
                assert_ne!(made, sound, "{} leaves {rig:?} as it was", kind.name);
                // Of what is not a number nothing is equal.
                if kind.cause != "non-finite" {
                    assert_eq!((made, about), make(5), "{} on {rig:?} is not the same twice", kind.name);
                }
            }
        }
    }
}
