//! What a run found, told in sentences: terminal, page and viewer say the same because all say this.

#![cfg_attr(not(test), deny(clippy::disallowed_methods))]

mod answer;
mod drivers;
mod explanations;
mod found;
mod headline;
mod hunting;
mod look_at;
mod next;
pub mod pool_story;
mod sizes;
mod story;
mod text;
mod told_warning;
mod two_arms;
mod warnings_page;

pub use answer::{Answer, answer};
pub use drivers::{channel_told, driver_told};
pub use explanations::{explanations, nested_sentence};
pub use found::{
    WITH_CURVES, all_found, briefly_found, kind_of, named_effect_text, shown_unlisted, unlisted_text,
    unlisted_toml,
};
pub use headline::headline;
pub use look_at::look_at;
pub use next::next_steps;
pub use sizes::{amplitude_text, candidate_sizes, size_in_table, sizes_of};
pub use story::{SHOWN, Story, status_sentence};
pub use text::{
    conclusion, conclusion_about, estimate_remark, estimate_shown, in_display_unit, supported_digits,
};
pub use told_warning::{ToldWarning, gravest_first};
pub use two_arms::{errors_are, joined_tips_text, scale_step};
pub use warnings_page::warnings_page;
