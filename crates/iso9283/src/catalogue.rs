//! The one list of all criteria: clause, symbol, name, what the standard asks for, what each needs. Tables and the
//! list of what a recording cannot show iterate it.
//!
//! Clauses are cited as deep as they could be confirmed from published tables of contents of the standard (and of
//! its identical adoption GB/T 12642-2013): three levels in 7.2 and 7.3, two in 7.4 to 8.6, one in 9 to 11.

use armcal_core::Unit;

/// What a criterion's number measures; decides its unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// A length: [m] inside, shown in mm.
    Length,
    /// An angle: [rad] inside, shown in degrees.
    Angle,
    /// A duration [s].
    Duration,
    /// A speed: [m/s] inside, shown in mm/s.
    Speed,
    /// A ratio, shown in percent.
    Ratio,
    /// Displacement per force: [m/N] inside, shown in mm/N.
    Compliance,
}

impl Quantity {
    /// Symbol of the SI unit, that of the unit shown to people (the standard's own), and how many of these it is.
    fn units(self) -> (&'static str, &'static str, f64) {
        let of = |unit: Unit| (unit.symbol(), unit.display_symbol(), unit.to_display(1.0));
        match self {
            Quantity::Length => of(Unit::Metre),
            Quantity::Angle => of(Unit::Radian),
            Quantity::Duration => of(Unit::Second),
            Quantity::Speed => of(Unit::MetrePerSecond),
            Quantity::Ratio => (Unit::One.symbol(), "%", 100.0),
            Quantity::Compliance => ("m/N", "mm/N", 1e3),
        }
    }

    /// Symbol of the SI unit.
    pub fn symbol(self) -> &'static str {
        self.units().0
    }

    /// Symbol of the unit shown to people.
    pub fn display_symbol(self) -> &'static str {
        self.units().1
    }

    /// Converts an SI value to the unit shown to people.
    pub fn to_display(self, si: f64) -> f64 {
        si * self.units().2
    }
}

/// Which part of a characteristic a criterion is; the index of its symbol.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Component {
    /// The only one: no index.
    Only,
    /// The position, P.
    Position,
    /// The radius of a sphere about the barycentre, l.
    Radius,
    /// Along x.
    X,
    /// Along y.
    Y,
    /// Along z.
    Z,
    /// About x.
    A,
    /// About y.
    B,
    /// About z.
    C,
}

impl Component {
    /// The angles, in order.
    pub const ANGLES: [Component; 3] = [Component::A, Component::B, Component::C];
    /// The axes, in order.
    pub const AXES: [Component; 3] = [Component::X, Component::Y, Component::Z];

    /// Index of the symbol, with its underscore; and what it adds to the name.
    fn words(self) -> (&'static str, &'static str) {
        match self {
            Component::Only => ("", ""),
            Component::Position => ("_P", ", position"),
            Component::Radius => ("_l", ", position"),
            Component::X => ("_x", ", along x"),
            Component::Y => ("_y", ", along y"),
            Component::Z => ("_z", ", along z"),
            Component::A => ("_a", ", about x"),
            Component::B => ("_b", ", about y"),
            Component::C => ("_c", ", about z"),
        }
    }

    /// Whether it is an angle.
    pub fn is_angle(self) -> bool {
        Component::ANGLES.contains(&self)
    }
}

/// A characteristic of the standard.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Characteristic {
    /// Clause of ISO 9283:1998.
    pub clause: &'static str,
    /// The standard's symbol without index; empty where the standard has none.
    pub symbol: &'static str,
    /// The standard's name.
    pub name: &'static str,
    /// Its parts.
    pub components: &'static [Component],
    /// The parts that the standard states as plus or minus three standard deviations.
    pub bands: &'static [Component],
    /// What its parts other than angles measure.
    pub quantity: Quantity,
    /// Cycles that the standard asks for.
    pub cycles: usize,
    /// What a recording must hold to show it.
    pub needs: &'static str,
}

impl Characteristic {
    /// Symbol of a part, such as `AP_P`.
    pub fn symbol_of(&self, component: Component) -> String {
        format!("{}{}", self.symbol, component.words().0)
    }

    /// Name of a part, such as `pose accuracy, about z`.
    pub fn name_of(&self, component: Component) -> String {
        format!("{}{}", self.name, component.words().1)
    }

    /// What a part measures.
    pub fn quantity_of(&self, component: Component) -> Quantity {
        if component.is_angle() { Quantity::Angle } else { self.quantity }
    }

    /// Whether a part is the half-width of a band, plus or minus.
    pub fn is_band(&self, component: Component) -> bool {
        self.bands.contains(&component)
    }
}

use Component::{A, B, C, Only, Position, Radius, X, Y, Z};

macro_rules! characteristics {
    ($($id:ident: $clause:literal $symbol:literal $name:literal, $components:expr, $bands:expr, $quantity:ident,
       $cycles:literal cycles, $needs:literal;)*) => {
        $(#[doc = concat!("Clause ", $clause, ": ", $name, " ", $symbol, ".")]
        pub static $id: Characteristic = Characteristic {
            clause: $clause, symbol: $symbol, name: $name, components: &$components, bands: &$bands,
            quantity: Quantity::$quantity, cycles: $cycles, needs: $needs,
        };)*
        /// Every characteristic of ISO 9283:1998, in the order of the standard.
        pub static CHARACTERISTICS: &[&Characteristic] = &[$(&$id),*];
    };
}

characteristics! {
    POSE_ACCURACY: "7.2.1" "AP" "pose accuracy", [Position, X, Y, Z, A, B, C], [], Length, 30 cycles,
        "needs visits to commanded poses";
    POSE_REPEATABILITY: "7.2.2" "RP" "pose repeatability", [Radius, A, B, C], [A, B, C], Length, 30 cycles,
        "needs repeated visits to a commanded pose from one direction";
    ACCURACY_VARIATION: "7.2.3" "vAP" "multi-directional pose accuracy variation", [Position, A, B, C],
        [], Length, 30 cycles, "needs repeated approaches to a commanded pose from 3 directions";
    DISTANCE_ACCURACY: "7.3.2" "AD" "distance accuracy", [Position, X, Y, Z, A, B, C], [], Length, 30 cycles,
        "needs moves from one commanded pose to another";
    DISTANCE_REPEATABILITY: "7.3.3" "RD" "distance repeatability", [Position, X, Y, Z, A, B, C],
        [Position, X, Y, Z, A, B, C], Length, 30 cycles, "needs repeated moves from one commanded pose to another";
    STABILIZATION_TIME: "7.4" "t" "position stabilization time", [Only], [], Duration, 3 cycles,
        "needs samples of the tip around the stop, and a limit band";
    OVERSHOOT: "7.5" "OV" "position overshoot", [Only], [], Length, 3 cycles,
        "needs samples of the tip around the stop, and a limit band";
    ACCURACY_DRIFT: "7.6" "dAP" "drift of pose accuracy", [Position, A, B, C], [], Length, 10 cycles,
        "needs a commanded pose visited again and again over hours";
    REPEATABILITY_DRIFT: "7.6" "dRP" "drift of pose repeatability", [Position, A, B, C], [], Length,
        10 cycles, "needs a commanded pose visited again and again over hours";
    EXCHANGEABILITY: "7.7" "E" "exchangeability", [Only], [], Length, 30 cycles,
        "needs one programme run by two or more robots of the same kind (the standard asks for five)";
    PATH_ACCURACY: "8.2" "AT" "path accuracy", [Position, A, B, C], [], Length, 10 cycles,
        "needs a commanded path and the attained one";
    PATH_REPEATABILITY: "8.3" "RT" "path repeatability", [Position, A, B, C], [], Length, 10 cycles,
        "needs a commanded path that is repeated";
    REORIENTATION: "8.4" "AT" "path accuracy on reorientation", [Position], [], Length, 10 cycles,
        "needs a commanded path along which the orientation changes";
    ROUND_OFF: "8.5" "CR" "cornering round-off error", [Only], [], Length, 3 cycles,
        "needs a commanded path with a corner";
    CORNER_OVERSHOOT: "8.5" "CO" "cornering overshoot", [Only], [], Length, 3 cycles,
        "needs a commanded path with a corner";
    VELOCITY_ACCURACY: "8.6" "AV" "path velocity accuracy", [Only], [], Ratio, 10 cycles,
        "needs a commanded path with a commanded speed";
    VELOCITY_REPEATABILITY: "8.6" "RV" "path velocity repeatability", [Only], [Only], Ratio, 10 cycles,
        "needs a commanded path with a commanded speed that is repeated";
    VELOCITY_FLUCTUATION: "8.6" "FV" "path velocity fluctuation", [Only], [], Speed, 10 cycles,
        "needs a commanded path with a commanded speed";
    POSING_TIME: "9" "" "minimum posing time", [Only], [], Duration, 3 cycles,
        "needs moves between two poses, with the time of departure and samples around the stop";
    STATIC_COMPLIANCE: "10" "" "static compliance", [Only], [], Compliance, 3 cycles,
        "needs static loads of known force on the resting arm";
    STROKE_ERROR: "11" "WS" "weaving stroke error", [Only], [], Ratio, 3 cycles,
        "needs a commanded weaving motion";
    FREQUENCY_ERROR: "11" "WF" "weaving frequency error", [Only], [], Ratio, 3 cycles,
        "needs a commanded weaving motion";
}
