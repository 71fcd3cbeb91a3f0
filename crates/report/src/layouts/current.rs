//! The format of Foxglove's layout API (foxglove-sdk `foxglove.layouts`, 2026).

use super::config::config;
use super::spec::{Content, Kind};
use serde_json::{Value, json};

pub(super) fn layout(content: &Content) -> Value {
    json!({ "version": 1, "variables": {}, "userScripts": {}, "content": node(content) })
}

fn node(content: &Content) -> Value {
    match content {
        Content::Panel(panel) => json!({
            "type": "panel",
            "panelType": panel_type(&panel.kind),
            "title": panel.title,
            "version": 1,
            "config": config(&panel.kind),
        }),
        Content::Split(direction, items) => {
            let item =
                |(share, content): &(f64, Content)| json!({ "proportion": share, "content": node(content) });
            json!({
                "type": "split",
                "direction": direction.word(),
                "items": items.iter().map(item).collect::<Vec<Value>>(),
            })
        }
        Content::Tabs(tabs) => {
            let tab =
                |(title, content): &(&str, Content)| json!({ "title": title, "content": node(content) });
            json!({ "type": "tabs", "selectedTabIndex": 0, "tabs": tabs.iter().map(tab).collect::<Vec<Value>>() })
        }
    }
}

fn panel_type(kind: &Kind) -> &'static str {
    match kind {
        Kind::Plot(_) => "Plot",
        Kind::View(_) => "ThreeDee",
        Kind::Table(_) => "Table",
        Kind::Raw(_) => "RawMessages",
        Kind::Indicator(..) => "Indicator",
    }
}
