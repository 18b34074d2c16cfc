//! What every control does with words of ISO 6983: modes, motions, arcs, compensation, cycles, offsets, calls. In: blocks as
//! words. Out: the moves of a [`Toolpath`](super::toolpath::Toolpath). What a family of dialects does differently is in its own folder;
//! the files here know no family by name and ask it through [`interpreter::Family`].

mod again;
mod arc;
mod budget;
pub(super) mod calls;
mod compensation;
mod corner;
mod cycles;
mod doubts;
pub(super) mod flow;
pub(super) mod interpreter;
pub(super) mod intersection;
pub(super) mod labels;
pub(super) mod messages;
mod motion;
mod record_block;
mod offsets;
mod settings;
mod shared_feeds;
pub(super) mod state;
mod thread_feeds;
mod tool_length;
pub(super) mod unroll;
pub(super) mod values;
pub(super) mod words;
