//! What a layout consists of, whatever format it is written in.

/// A tree of panels.
pub(super) enum Content {
    Panel(Panel),
    /// Side by side (`row`) or one above the other (`column`), with their shares of the space.
    Split(Direction, Vec<(f64, Content)>),
    Tabs(Vec<(&'static str, Content)>),
}

#[derive(Clone, Copy)]
pub(super) enum Direction {
    Row,
    Column,
}

impl Direction {
    pub fn word(self) -> &'static str {
        match self {
            Direction::Row => "row",
            Direction::Column => "column",
        }
    }
}

/// One panel under its title.
pub(super) struct Panel {
    pub title: String,
    pub kind: Kind,
}

pub(super) enum Kind {
    Plot(Plot),
    View(View),
    /// An array of messages, by its path.
    Table(String),
    /// A message or a field of one, by its path.
    Raw(String),
    /// A lamp: path, and value, colour and label of each rule.
    Indicator(String, Vec<(&'static str, Colour, &'static str)>),
}

/// Arrays of one message against an array of the same message: a plot against time would show the days between recordings.
pub(super) struct Plot {
    pub x_path: String,
    pub x_label: String,
    pub y_label: String,
    /// Where panels are compared: their common range. Otherwise that of the data.
    pub y_range: Option<[f64; 2]>,
    /// How many points lie outside of it.
    pub beyond: usize,
    pub series: Vec<Series>,
}

pub(super) struct Series {
    /// A path, or a number for a level line.
    pub path: String,
    pub label: String,
    pub colour: Colour,
    pub line: bool,
}

/// A colour, and how people call it.
#[derive(Clone, Copy)]
pub(super) struct Colour {
    pub hex: &'static str,
    pub name: &'static str,
}

/// A 3D panel.
pub(super) struct View {
    /// The frame it looks at.
    pub frame: &'static str,
    pub target_m: [f64; 3],
    pub distance_m: f64,
    /// Angle of the camera from the vertical and about it [deg]; none looks straight down, without perspective.
    pub angles_deg: Option<[f64; 2]>,
    /// Topics, and whether they are shown at first.
    pub topics: Vec<(&'static str, bool)>,
    /// Topics with the text of a robot, to be switched on.
    pub robots: Vec<&'static str>,
}

impl Content {
    pub fn panel(title: impl Into<String>, kind: Kind) -> Content {
        Content::Panel(Panel { title: title.into(), kind })
    }

    /// A plot; its title says which colour is what, because a legend lies over the data or takes their place, and what is not
    /// in the picture.
    pub fn plot(title: &str, plot: Plot) -> Content {
        let mut named: Vec<String> =
            plot.series.iter().map(|s| format!("{} {}", s.label, s.colour.name)).collect();
        named.dedup();
        let mut title =
            if named.len() > 1 { format!("{title}: {}", named.join(", ")) } else { title.to_owned() };
        if plot.beyond > 0 {
            title += &format!("; {} beyond", plot.beyond);
        }
        Content::panel(title, Kind::Plot(plot))
    }

    /// Equal shares.
    pub fn even(direction: Direction, items: Vec<Content>) -> Content {
        Content::Split(direction, items.into_iter().map(|item| (1.0, item)).collect())
    }
}
