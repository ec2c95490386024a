//! The `straightedge` command, and the page of the browser.

#[cfg(not(target_arch = "wasm32"))]
fn main() -> std::process::ExitCode {
    #[cfg(feature = "window")]
    let window = straightedge::app::run;
    #[cfg(not(feature = "window"))]
    let window = |_| Err("this program was built without it".to_owned());
    straightedge::cli::main(window)
}

#[cfg(all(target_arch = "wasm32", feature = "window"))]
fn main() {
    straightedge::app::web::start();
}

#[cfg(all(target_arch = "wasm32", not(feature = "window")))]
fn main() {}
