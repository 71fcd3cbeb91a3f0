//! Telescopes that are published as one sum: their segments are joints of the URDF that nobody recorded, and what was recorded is no
//! joint of it.

use super::links::{joints_of, link_path};
use roxmltree::{Document, Node};
use std::collections::BTreeSet;

/// A URDF whose telescope follows its sum.
#[derive(Debug, PartialEq)]
pub struct Telescope {
    /// The text of the URDF with it.
    pub text: String,
    /// What was taken on trust.
    pub said: String,
}

/// A joint that slides and does not follow another.
struct Slide<'a> {
    name: &'a str,
    parent: &'a str,
    child: &'a str,
    axis: Option<&'a str>,
    upper: f64,
    /// Where its element ends in the text.
    end: usize,
}

const END: &str = "</joint>";

/// Lets the segments of the only telescope that is not among the recorded joints follow the only recorded one that the URDF does not
/// have; none where there is no such pair.
pub fn follow_sum(text: &str, recorded: &BTreeSet<&str>) -> Option<Telescope> {
    let document = Document::parse(text).ok()?;
    let robot = document.root_element();
    let joints = || robot.children().filter(|node| node.has_tag_name("joint"));
    let known: BTreeSet<&str> = joints().filter_map(|joint| joint.attribute("name")).collect();
    let mut unknown = recorded.difference(&known);
    let (Some(sum), None) = (unknown.next(), unknown.next()) else { return None };
    let slides: Vec<Slide<'_>> = joints()
        .filter_map(|joint| slide_of(joint, text))
        .filter(|slide| !recorded.contains(slide.name))
        .collect();
    let segments = segments_of(&slides)?;
    let share = 1.0 / segments.len() as f64;
    let mut inserted: Vec<(usize, String)> = segments
        .iter()
        .map(|own| (own.end - END.len(), format!("<mimic joint=\"{sum}\" multiplier=\"{share}\"/>")))
        .collect();
    // At the root, where it ends no arm.
    let links = joints_of(robot);
    let root = links.get(link_path(&links, segments[0].child).first()?)?.parent;
    let reach: f64 = segments.iter().map(|own| own.upper).sum();
    let leader = format!(
        "<link name=\"{sum}_link\"/><joint name=\"{sum}\" type=\"prismatic\"><parent link=\"{root}\"/><child link=\"{sum}_link\"/>\
         <axis xyz=\"1 0 0\"/><limit lower=\"0\" upper=\"{reach}\" effort=\"0\" velocity=\"0\"/></joint>\n"
    );
    inserted.push((text.rfind("</robot>")?, leader));
    inserted.sort_by_key(|(at, _)| *at);
    let mut with = text.to_owned();
    inserted.iter().rev().for_each(|(at, piece)| with.insert_str(*at, piece));
    let names: Vec<&str> = segments.iter().map(|own| own.name).collect();
    let said = format!(
        "{sum} is recorded and no joint of the URDF, and its telescope {} is not recorded: {sum} is taken for the sum of these, in equal \
         parts, in a copy of the URDF",
        names.join(", ")
    );
    Some(Telescope { text: with, said })
}

fn slide_of<'a>(joint: Node<'a, '_>, text: &str) -> Option<Slide<'a>> {
    let child = |tag: &str| joint.children().find(|node| node.has_tag_name(tag));
    let slides = joint.attribute("type") == Some("prismatic") && child("mimic").is_none();
    let end = joint.range().end;
    let slide = Slide {
        name: joint.attribute("name")?,
        parent: child("parent")?.attribute("link")?,
        child: child("child")?.attribute("link")?,
        axis: child("axis").and_then(|axis| axis.attribute("xyz")),
        upper: child("limit").and_then(|limit| limit.attribute("upper")?.parse().ok()).unwrap_or(0.0),
        end,
    };
    (slides && text[..end].ends_with(END)).then_some(slide)
}

/// Two and more slides along one axis, each on the one before; none where there are several such runs.
fn segments_of<'s, 'a>(slides: &'s [Slide<'a>]) -> Option<Vec<&'s Slide<'a>>> {
    let next =
        |own: &Slide<'_>| slides.iter().find(|other| other.parent == own.child && other.axis == own.axis);
    let is_first =
        |own: &&Slide<'_>| !slides.iter().any(|other| other.child == own.parent && other.axis == own.axis);
    let run = |first: &'s Slide<'a>| {
        let mut run: Vec<&'s Slide<'a>> = vec![first];
        while let Some(more) = run.last().and_then(|last| next(last)).filter(|_| run.len() <= slides.len()) {
            run.push(more);
        }
        run
    };
    let mut runs = slides.iter().filter(is_first).map(run).filter(|run| run.len() > 1);
    let only = runs.next()?;
    runs.next().is_none().then_some(only)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn robot(segments: usize) -> String {
        let joint = |k: usize| {
            format!(
                "<joint name=\"s{k}\" type=\"prismatic\"><parent link=\"l{k}\"/><child link=\"l{}\"/><axis xyz=\"1 0 0\"/>\
                 <limit upper=\"0.1\"/></joint>",
                k + 1
            )
        };
        let lift = "<joint name=\"lift\" type=\"prismatic\"><parent link=\"b\"/><child link=\"l0\"/><axis xyz=\"0 0 1\"/></joint>";
        format!("<robot name=\"r\">{lift}{}</robot>", (0..segments).map(joint).collect::<String>())
    }

    #[test]
    fn segments_that_were_not_recorded_follow_the_sum_that_was() {
        let text = robot(4);
        let found = follow_sum(&text, &["lift", "extension"].into()).expect("a telescope");
        assert_eq!(found.text.matches("<mimic joint=\"extension\" multiplier=\"0.25\"/></joint>").count(), 4);
        assert!(
            found.text.contains("<joint name=\"extension\" type=\"prismatic\"><parent link=\"b\"/>")
                && found.text.contains("upper=\"0.4\""),
            "{}",
            found.text
        );
        assert!(found.said.contains("s0, s1, s2, s3"));
        Document::parse(&found.text).expect("XML");
        for recorded in [vec!["lift"], vec!["lift", "s0", "s1", "s2", "s3", "x"], vec!["lift", "x", "y"]] {
            assert_eq!(follow_sum(&text, &recorded.into_iter().collect()), None);
        }
        assert_eq!(follow_sum(&robot(1), &["lift", "extension"].into()), None, "one slide is no telescope");
    }
}
