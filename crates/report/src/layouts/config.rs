//! Settings of panels, which both formats share.

use super::spec::{Colour, Kind, Plot, Series, View};
use super::views::OPENING_DEG;
use crate::channels::cloud;
use serde_json::{Map, Value, json};

/// The type of a panel; that of 3D views has another name in each format.
pub(super) fn panel_type(kind: &Kind, view: &'static str) -> &'static str {
    match kind {
        Kind::Plot(_) => "Plot",
        Kind::View(_) => view,
        Kind::Table(_) => "Table",
        Kind::Raw(_) => "RawMessages",
        Kind::Indicator(..) => "Indicator",
    }
}

/// The settings of a panel.
pub(super) fn panel_config(kind: &Kind) -> Map<String, Value> {
    let value = match kind {
        Kind::Plot(plot) => plot_config(plot),
        Kind::View(view) => view_config(view),
        Kind::Table(path) => json!({ "topicPath": path }),
        Kind::Raw(path) => json!({ "topicPath": path, "diffEnabled": false, "expansion": "all" }),
        Kind::Indicator(path, rules) => {
            let rule = |(value, colour, label): &(&str, Colour, &str)| json!({ "rawValue": value, "operator": "=", "color": colour.hex, "label": label });
            let rules: Vec<Value> = rules.iter().map(rule).collect();
            json!({ "path": path, "style": "background", "rules": rules,
                    "fallbackColor": "#777777", "fallbackLabel": "waiting for the first message" })
        }
    };
    match value {
        Value::Object(map) => map,
        _ => Map::new(),
    }
}

fn plot_config(plot: &Plot) -> Value {
    let mut config = json!({
        "paths": plot.series.iter().map(series_config).collect::<Vec<Value>>(),
        "xAxisVal": "currentCustom",
        "xAxisPath": { "value": plot.x_path, "enabled": true },
        "xAxisLabel": plot.x_label,
        "yAxisLabel": plot.y_label,
        "isSynced": false,
        "showLegend": false,
        "legendDisplay": "none",
        "showPlotValuesInLegend": false,
        "showXAxisLabels": true,
        "showYAxisLabels": true,
    });
    if let Some([least, most]) = plot.y_range {
        config["minYValue"] = json!(least);
        config["maxYValue"] = json!(most);
    }
    config
}

fn series_config(s: &Series) -> Value {
    json!({
        "value": s.path,
        "enabled": true,
        "label": s.label,
        "color": s.colour.hex,
        "timestampMethod": "receiveTime",
        "showLine": s.line,
        "lineSize": if s.line { 1.5 } else { 3.0 },
    })
}

fn view_config(view: &View) -> Value {
    let topic = |(topic, visible): &(&str, bool)| {
        let settings = match *topic {
            t if t.contains("/path_") => json!({ "visible": visible, "type": "line", "lineWidth": 0.001 }),
            cloud::TOPIC => json!({
                "visible": visible, "pointSize": 7, "pointShape": "circle", "colorMode": "rgba-fields",
            }),
            // Axes of a metre otherwise.
            "/armcal/tip_measured" => json!({ "visible": visible, "axisScale": 0.03 }),
            // Otherwise the black edges of a small arrow hide its colour.
            _ => json!({ "visible": visible, "showOutlines": false }),
        };
        ((*topic).to_owned(), settings)
    };
    let topics: Map<String, Value> = view.topics.iter().map(topic).collect();
    let [x, y, z] = view.target_m;
    let [phi, theta] = view.angles_deg.unwrap_or_default();
    json!({
        "cameraState": {
            "perspective": view.angles_deg.is_some(),
            "distance": view.distance_m,
            "phi": phi,
            "thetaOffset": theta,
            "targetOffset": [x, y, z],
            "target": [0, 0, 0],
            "targetOrientation": [0, 0, 0, 1],
            "fovy": OPENING_DEG,
            "near": 0.01,
            "far": 100,
        },
        "followTf": view.frame,
        "followMode": "follow-none",
        // Without these every link and board has a name and axes of its own in the picture, and a frame that comes with a
        // later message is a problem until then.
        "scene": {
            "transforms": { "showLabel": false, "axisScale": 0, "lineWidth": 0, "enablePreloading": true },
        },
        "transforms": {},
        "topics": topics,
        "layers": robot_layers(&view.robots),
    })
}

/// Layers that draw URDF from topics; the links are called like the frames, so they have no prefix.
fn robot_layers(topics: &[&str]) -> Map<String, Value> {
    let layer = |(order, topic): (usize, &&str)| {
        let settings = json!({
            "instanceId": topic,
            "layerId": "foxglove.Urdf",
            "label": topic,
            "sourceType": "topic",
            "topic": topic,
            "framePrefix": "",
            "visible": false,
            "order": order + 1,
        });
        ((*topic).to_owned(), settings)
    };
    topics.iter().enumerate().map(layer).collect()
}
