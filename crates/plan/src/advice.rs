//! What tells two effects apart that are the same to every motion (notes/diagnosis.md, section 3).

/// The sensor or test that separates two effects, by their kinds.
pub fn sensor(a: &str, b: &str) -> &'static str {
    let kind = |name: &str| name.split([':', '@', ',']).next().unwrap_or_default().to_owned();
    let pair = [kind(a), kind(b)];
    let has = |kinds: &[&str]| pair.iter().any(|k| kinds.contains(&k.as_str()));
    let both = |kinds: &[&str]| pair.iter().all(|k| kinds.contains(&k.as_str()));
    let lost_motion =
        ["backlash", "friction_windup", "gravity_backlash", "crossed_backlash", "belt_backlash"];
    let elastic = [
        "compliance",
        "arm_compliance",
        "hardening_compliance",
        "effort_compliance",
        "belt_compliance",
        "link_bending",
    ];
    match () {
        () if has(&["base_compliance"]) => {
            "put a marker on the robot's base: it moves only if the base gives way"
        }
        () if has(&["unsettled_reading"]) => {
            "wait longer before the joints are read, or come to the same poses from near and from far"
        }
        () if has(&["undeclared_load"]) => "weigh what the tool carries, and declare it as `load_kg`",
        () if both(&lost_motion) => {
            "record the motor currents, or rest in the same poses with the motors off"
        }
        () if both(&elastic) => "put a marker on the forearm close to its joint, or lock the belt",
        () if has(&["zero_slip", "tool_shift", "frame_shift"]) => {
            "put a static marker on the base and a second one on the tool, or move every joint widely in each recording"
        }
        () if both(&["sensor_scale", "board_scale", "thermal_growth", "warm_up"]) => {
            "measure one known length, such as a bar with two markers"
        }
        () if both(&["eccentricity", "second_harmonic", "gear_ratio", "periodic", "error_curve"]) => {
            "compare the encoder with one on the joint itself, or turn the joint over its whole range"
        }
        () if both(&["zero_drift", "frame_drift", "thermal_growth", "warm_up", "tool_shift"]) => {
            "put a static marker on the base and record the temperature of the links"
        }
        () => "put a marker on the base or on a link, or record the motor currents",
    }
}
