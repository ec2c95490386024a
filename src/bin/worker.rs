//! The program of the browser's workers.

#[cfg(target_arch = "wasm32")]
fn main() {
    straightedge::worker::serve();
}

#[cfg(not(target_arch = "wasm32"))]
compile_error!("the worker is for browsers: build it with `trunk build`, as README.md says");
