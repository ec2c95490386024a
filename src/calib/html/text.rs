//! Words of the page, and how other people's words get into it.

/// Text that is safe between tags and in attributes.
pub(in super::super) fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out += "&amp;",
            '<' => out += "&lt;",
            '>' => out += "&gt;",
            '"' => out += "&quot;",
            '\'' => out += "&#39;",
            c => out.push(c),
        }
    }
    out
}

pub(super) const CONVENTIONS: &str = "<ul class=\"plain\">
<li>Pixel (0, 0) is the <em>centre</em> of the top-left pixel; x points right, y down.</li>
<li>Camera frame: x right, y down, z forward. Board frame: x along the columns, y along the rows, z away from the camera's side; the origin is corner 0.</li>
<li>Index of a corner = row · columns + column over the full board, also where only a part is seen.</li>
<li>Rotation vector and translation are <code>camera_from_board</code>, as OpenCV's.</li>
<li>Residual = observed − projected. RMS = √(Σ|r|²/N) over all corners of the pictures used, unweighted, outliers counted; errors are lengths |r|.</li>
<li>σ is a posteriori, one standard deviation; the covariance includes the uncertainty of all poses.</li>
<li>Tilt is the angle between the board's normal and the optical axis, roll the rotation about it, distance that of the middle of the board.</li>
</ul>
";

pub(super) const NUMBERS: &str = "<p>Every number of this run in full precision (corners, residuals, poses, covariance, settings) is in this file, as the JSON that \
<code>straightedge calibrate --json</code> prints. <code>straightedge check FILE.html</code> solves again from the corners and settings in this file and compares every parameter; \
<code>straightedge calibrate --corners FILE.json</code> calibrates from the corners with other settings. Every command that takes a camera \
file also takes this page.</p>
<p><button type=\"button\" id=\"save\">Save the JSON</button></p>
";

/// The only script: it hands out the embedded JSON.
pub(super) const SAVE: &str = "document.getElementById('save').onclick=()=>{const a=document.createElement('a');\
a.href=URL.createObjectURL(new Blob([document.getElementById('report').textContent.trim()+'\\n'],{type:'application/json'}));\
a.download='calibration.json';a.click();};";
