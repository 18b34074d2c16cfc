//! Where the scripts draw the views and list the program. In: nothing. Out: markup, hidden until a script shows it; the
//! scripts know its parts by their ids.

use maud::{Markup, html};

use crate::report::html::key;

/// All views.
pub fn views() -> Markup {
    html! {
        section class="needs-script" hidden {
            h2 { "Where" } "\n"
            (map())
            h2 { "Feed and load" } "\n"
            (curves())
            (program())
            div id="tip" hidden {}
        }
        "\n"
    }
}

/// The path from above and in space.
fn map() -> Markup {
    html! {
        div class="controls" {
            button id="show-above" aria-pressed="true" { "from above" }
            button id="show-space" aria-pressed="false" { "in space" }
            label { "coloured by " select id="quantity" {} }
            span class="legend" id="legend" {}
            label id="stock-choice" hidden { input type="checkbox" id="with-stock" checked; " stock" }
            span id="no-stock" hidden {
                "No stock is shown: what the cutter meets came from the cache of an earlier run."
            }
        }
        p id="no-space" hidden { "This browser has no WebGL2, so the path is shown from above only." }
        canvas id="above" aria-label="path from above" {}
        canvas id="space" aria-label="path and stock in space" hidden {}
        div class="controls" {
            button id="play" { "play" }
            input type="range" id="until" min="0" max="1000" value="1000" aria-label="place on the path";
        }
        div id="here" aria-live="polite" {
            "Point at the path or a curve for its line; click to find it in the program."
        }
        "\n"
    }
}

/// Feed and load over path or time.
fn curves() -> Markup {
    let keys = [("var(--before)", "as programmed"), ("var(--after)", "as written"), ("var(--limit)", "limit")];
    html! {
        div class="controls" {
            label { "over " select id="axis" { option value="path" { "the path" } option value="time" { "time" } } }
            @for (colour, name) in keys { (key(colour, name)) }
        }
        canvas id="curves-canvas" aria-label="feed and load along the program" {}
        "\n"
    }
}

/// The program line by line.
fn program() -> Markup {
    html! {
        div id="listing-part" {
            h2 { "Line by line" }
            div class="controls" {
                button id="previous-change" { "previous change" }
                button id="next-change" { "next change" }
                label { input type="checkbox" id="only-changed"; " only changed lines" }
            }
            div id="listing" tabindex="0" aria-label="program as it was and as written" {}
        }
        "\n"
    }
}
