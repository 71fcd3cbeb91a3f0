//! What a run found, told in sentences: terminal, page and viewer say the same because all say this.

#![cfg_attr(not(test), deny(clippy::disallowed_methods))]

mod answer;
mod drivers;
mod explanations;
mod found;
mod headline;
mod look_at;
mod next;
pub mod pool_story;
mod sizes;
mod story;
mod text;
mod told_warning;
mod two_arms;

pub use answer::{Answer, answer};
pub use drivers::{channel_told, driver_told};
pub use explanations::{explanations, nested_sentence};
pub use found::{WITH_CURVES, all_found, briefly_found, found, kind_of, pasted, shown_unlisted, unlisted};
pub use headline::headline;
pub use look_at::look_at;
pub use next::next;
pub use sizes::{amplitude_text, size_in_table, sizes, sizes_of};
pub use story::{SHOWN, Story, status_sentence};
pub use text::{conclusion, conclusion_about, estimate_shown, in_display_unit, remark, supported};
pub use told_warning::{ToldWarning, gravest_first};
pub use two_arms::{about, errors_are, scale};
