//! Settings of panels, which both formats share.

use super::spec::{Kind, Plot, Series, View, X};
use serde_json::{Map, Value, json};

/// The settings of a panel.
pub(super) fn config(kind: &Kind) -> Map<String, Value> {
    let value = match kind {
        Kind::Plot(plot) => plot_config(plot),
        Kind::View(view) => view_config(view),
        Kind::Table(path) => json!({ "topicPath": path }),
        Kind::Raw(path) => json!({ "topicPath": path, "diffEnabled": false, "expansion": "all" }),
        Kind::Indicator(path, rules) => {
            let rule = |[value, colour, label]: &[&str; 3]| json!({ "rawValue": value, "operator": "=", "color": colour, "label": label });
            let rules: Vec<Value> = rules.iter().map(rule).collect();
            json!({ "path": path, "style": "background", "rules": rules,
                    "fallbackColor": "#777777", "fallbackLabel": "not diagnosed" })
        }
        Kind::Log(topic) => json!({ "topicToRender": topic, "minLogLevel": 1, "searchTerms": [] }),
        Kind::States(paths) => {
            let path = |[value, label]: &[&str; 2]| json!({ "value": value, "label": label, "timestampMethod": "receiveTime" });
            let paths: Vec<Value> = paths.iter().map(path).collect();
            json!({ "paths": paths, "isSynced": true })
        }
    };
    match value {
        Value::Object(map) => map,
        _ => Map::new(),
    }
}

fn plot_config(plot: &Plot) -> Value {
    let mut config = json!({
        "paths": plot.series.iter().map(series).collect::<Vec<Value>>(),
        "xAxisVal": "timestamp",
        "yAxisLabel": plot.y_label,
        "isSynced": true,
        "showLegend": true,
        "legendDisplay": "floating",
        "showPlotValuesInLegend": false,
        "showXAxisLabels": true,
        "showYAxisLabels": true,
    });
    if let Some([least, most]) = plot.y_range {
        config["minYValue"] = json!(least);
        config["maxYValue"] = json!(most);
    }
    if let X::Array(path, label) = &plot.x {
        config["xAxisVal"] = json!("currentCustom");
        config["xAxisPath"] = json!({ "value": path, "enabled": true });
        config["xAxisLabel"] = json!(label);
        config["isSynced"] = json!(false);
    }
    config
}

fn series(s: &Series) -> Value {
    json!({
        "value": s.path,
        "enabled": true,
        "label": s.label,
        "color": s.colour,
        "timestampMethod": "receiveTime",
        "showLine": s.line,
        "lineSize": if s.line { 1.5 } else { 3.0 },
    })
}

fn view_config(view: &View) -> Value {
    let topic = |(topic, visible): &(&str, bool)| {
        let settings = match topic.contains("/path_") {
            true => json!({ "visible": visible, "type": "line", "lineWidth": 0.001 }),
            false => json!({ "visible": visible }),
        };
        ((*topic).to_owned(), settings)
    };
    let topics: Map<String, Value> = view.topics.iter().map(topic).collect();
    let [x, y, z] = view.target_m;
    json!({
        "cameraState": {
            "perspective": !view.from_above,
            "distance": view.distance_m,
            "phi": if view.from_above { 0.0 } else { 60.0 },
            "thetaOffset": if view.from_above { 0.0 } else { 45.0 },
            "targetOffset": [x, y, z],
            "target": [0, 0, 0],
            "targetOrientation": [0, 0, 0, 1],
            "fovy": 45,
            "near": 0.01,
            "far": 100,
        },
        "followTf": view.frame,
        "followMode": "follow-none",
        "scene": { "transforms": { "visible": false } },
        "transforms": {},
        "topics": topics,
        "layers": {},
    })
}
