//! The format of Foxglove Studio, which Lichtblick reads: panels in a map by name, and a binary tree of names.

use super::config::{panel_config, panel_type};
use super::spec::{Content, Direction, Kind};
use serde_json::{Map, Value, json};

/// Foxglove Studio's, and Lichtblick's.
const TITLE_KEYS: [&str; 2] = ["foxglovePanelTitle", "lichtblickPanelTitle"];

pub(super) fn layout(content: &Content) -> Value {
    let mut panels = Map::new();
    let tree = content_node(content, &mut panels);
    json!({
        "configById": panels,
        "globalVariables": {},
        "userNodes": {},
        "playbackConfig": { "speed": 1 },
        "layout": tree,
    })
}

/// Adds the panels of the content and returns the tree of their names.
fn content_node(content: &Content, panels: &mut Map<String, Value>) -> Value {
    match content {
        Content::Panel(panel) => {
            let mut settings = panel_config(&panel.kind);
            for key in TITLE_KEYS {
                settings.insert(key.into(), json!(panel.title));
            }
            if matches!(panel.kind, Kind::Plot(_)) {
                settings.insert("sidebarDimension".into(), json!(240));
            }
            json!(add_panel(panel_type(&panel.kind, "3D"), settings, panels))
        }
        Content::Split(direction, items) => split_node(*direction, items, panels),
        Content::Tabs(tabs) => {
            let tabs: Vec<Value> = tabs
                .iter()
                .map(|(title, content)| json!({ "title": title, "layout": content_node(content, panels) }))
                .collect();
            let settings = Map::from_iter([("activeTabIdx".into(), json!(0)), ("tabs".into(), json!(tabs))]);
            json!(add_panel("Tab", settings, panels))
        }
    }
}

/// The first item against the rest.
fn split_node(direction: Direction, items: &[(f64, Content)], panels: &mut Map<String, Value>) -> Value {
    let Some(((share, first), rest)) = items.split_first() else { return Value::Null };
    let first = content_node(first, panels);
    if rest.is_empty() {
        return first;
    }
    let all = share + rest.iter().map(|(share, _)| share).sum::<f64>();
    json!({
        "first": first,
        "second": split_node(direction, rest, panels),
        "direction": direction.word(),
        "splitPercentage": (1000.0 * share / all).round() / 10.0,
    })
}

/// Names the panel by its type and how many there are.
fn add_panel(panel_type: &str, settings: Map<String, Value>, panels: &mut Map<String, Value>) -> String {
    let name = format!("{panel_type}!armcal{}", panels.len() + 1);
    panels.insert(name.clone(), Value::Object(settings));
    name
}
