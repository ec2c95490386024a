//! The program of the browser: the page, and each of its workers.

#[cfg(target_arch = "wasm32")]
fn main() {
    if let Some(worker) = straightedge::worker::scope() {
        straightedge::worker::serve(&worker);
    } else {
        straightedge::app::web::start();
    }
}

#[cfg(not(target_arch = "wasm32"))]
compile_error!("this program is for browsers: build it with `trunk build`, as README.md says");
