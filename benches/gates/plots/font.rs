//! Letters of plots, as strokes.

/// A letter and its strokes: each a row of points, each point its x and y, the line that letters stand on at y = 2; capitals are 6 high.
const LETTERS: &str = "\
0 120307183847433212|1 062822 0242|2 07183847460242|3 071838474635 25354443321203|4 32380444|5 480805354443321203
6 3818070312324344351504|7 084812|8 15040312324344351506071838474635|9 1232434738180706153546
a 06364542 441403123243|b 0802 0516364543321203|c 4536160503123243|d 4842 4536160503123243|e 044445361605031242
f 38281712 0636|g 4536160503123243 46413010|h 0802 0516364542|i 0602 0808|j 161100 1818|k 0802 3604 1432|l 0802
m 0602 05162522 25364542|n 0602 0516364542|o 160503123243453616|p 0600 0516364543321203|q 4640 4536160503123243
r 0602 041636|s 4616051434433202|t 18132232 0636|u 0603123243 4642|v 062246|w 0612243246|x 0642 0246|y 0622 4610
z 06460242|A 022842 1434|B 02083847463505 3544433202|C 4738180703123243|D 02082846442202|E 48080242 0535|F 480802 0535
G 47381807031232434525|H 0208 4248 0545|I 0208|J 4843321203|K 0802 4804 1542|L 080242|M 0208254842|N 02084248
O 120307183847433212|P 02083847463505|Q 120307183847433212 2442|R 02083847463505 2542|S 473818070615354443321203
T 0848 2822|U 080312324348|V 082248|W 0812253248|X 0842 0248|Y 082548 2522|Z 08480242
. 0202|, 1201|- 0545|+ 0545 2327|/ 0248|( 18070312|) 08171302|= 0444 0646|' 0807|: 0303 0505|; 0505 1201|% 0248 0808 4242
> 074503|< 470543";

/// Least distance between letters, and the width of a space.
const GAP: f64 = 1.9;
const SPACE: f64 = 3.0;
/// Size and rise of what `^` raises.
const RAISED: [f64; 2] = [0.75, 3.5];

/// A stroke of a letter: its ends.
pub type Stroke = [[f64; 2]; 2];

/// The strokes of a line of text that begins at x = 0, y upward, and its width; `^` raises all that follows up to a space. Letters that have
/// no strokes are spaces.
pub fn strokes(text: &str) -> (Vec<Stroke>, f64) {
    let (mut out, mut at, mut scale, mut rise) = (Vec::new(), 0.0, 1.0, 0.0);
    for letter in text.chars() {
        match letter {
            '^' => [scale, rise] = RAISED,
            _ => {
                let Some(drawn) = find(letter) else {
                    (at, scale, rise) = (at + SPACE, 1.0, 0.0);
                    continue;
                };
                let position = |[x, y]: [f64; 2]| [at + scale * x, rise + scale * y];
                let mut width = 0.0f64;
                for row in drawn.split(' ') {
                    let points: Vec<[f64; 2]> = row
                        .as_bytes()
                        .chunks(2)
                        .map(|xy| [xy[0], xy[1]].map(|c| f64::from(c - b'0')))
                        .collect();
                    width = points.iter().fold(width, |width, point| width.max(point[0]));
                    let last = points.len() - 1;
                    out.extend(
                        (0..last.max(1)).map(|i| [position(points[i]), position(points[(i + 1).min(last)])]),
                    );
                }
                at += scale * (width + GAP);
            }
        }
    }
    (out, (at - GAP).max(0.0))
}

/// The strokes of a letter.
fn find(letter: char) -> Option<&'static str> {
    LETTERS.split(['|', '\n']).find_map(|entry| entry.strip_prefix(letter)?.strip_prefix(' '))
}
