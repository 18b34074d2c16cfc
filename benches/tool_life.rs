//! The loop of `toollife` on a plant that the regulation does not know: share of tools that reach the target, time, tracking
//! error and how often the interval of the predicted end holds, over the exponent of the feed, with the same random numbers for
//! every way. `cargo bench --bench tool_life -- 2000` for another number of tools than 1000.

#![allow(clippy::print_stdout)]

#[path = "../tests/common/wear_plant.rs"]
mod wear_plant;

use wear_plant::{SHOP, table};

fn main() {
    let tools = std::env::args().find_map(|word| word.parse().ok()).unwrap_or(1000);
    println!("{tools} tools, target {} m, which a mean tool just reaches at the feed of the plan", SHOP.target_m);
    print!("{}", table(&SHOP, tools));
}
