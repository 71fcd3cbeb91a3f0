//! The format of Foxglove's layout API (foxglove-sdk `foxglove.layouts`, 2026).

use super::config::{panel_config, panel_type};
use super::spec::Content;
use serde_json::{Value, json};

pub(super) fn layout(content: &Content) -> Value {
    json!({ "version": 1, "variables": {}, "userScripts": {}, "content": content_node(content) })
}

fn content_node(content: &Content) -> Value {
    match content {
        Content::Panel(panel) => json!({
            "type": "panel",
            "panelType": panel_type(&panel.kind, "ThreeDee"),
            "title": panel.title,
            "version": 1,
            "config": panel_config(&panel.kind),
        }),
        Content::Split(direction, items) => {
            let item = |(share, content): &(f64, Content)| json!({ "proportion": share, "content": content_node(content) });
            json!({
                "type": "split",
                "direction": direction.word(),
                "items": items.iter().map(item).collect::<Vec<Value>>(),
            })
        }
        Content::Tabs(tabs) => {
            let tab = |(title, content): &(&str, Content)| json!({ "title": title, "content": content_node(content) });
            json!({ "type": "tabs", "selectedTabIndex": 0, "tabs": tabs.iter().map(tab).collect::<Vec<Value>>() })
        }
    }
}
