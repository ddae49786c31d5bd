//! Both bounds of a visibility matrix as a picture: witnessed, undecided, hidden.

use super::html::png_address;
use enfilade::BitMatrix;

/// Pixels a side, at most.
const LARGEST: usize = 640;
/// Red, green, blue of witnessed pairs.
pub const WITNESSED: [u8; 3] = [58, 122, 214];
/// The same of undecided pairs. Hidden pairs are transparent and show the page's colour.
pub const UNDECIDED: [u8; 3] = [226, 74, 20];

/// A picture of a matrix.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct MatrixPicture {
    /// Pixels a side.
    pub side: usize,
    /// Rows and columns of a pixel.
    pub block: usize,
    /// Red, green, blue, opacity, row by row from the top.
    pub pixels: Vec<[u8; 4]>,
}

/// Draws two square matrices of one size; `lower` is a subset of `upper`. The opacity of a pixel is the share of its pairs that
/// are not hidden. A pixel with any undecided pair has that colour, so that none is lost.
pub fn matrix(lower: &BitMatrix, upper: &BitMatrix) -> MatrixPicture {
    let n = upper.rows();
    let block = n.div_ceil(LARGEST).max(1);
    let side = n.div_ceil(block);
    let mut counts = vec![[0usize; 2]; side * side];
    for row in 0..n {
        for column in upper.ones(row) {
            let count = &mut counts[row / block * side + column / block];
            count[usize::from(!lower.get(row, column))] += 1;
        }
    }
    let length = |k: usize| block.min(n - k * block);
    let pixel = |(i, &[witnessed, undecided]): (usize, &[usize; 2])| {
        let pairs = length(i / side) * length(i % side);
        let [r, g, b] = if undecided > 0 { UNDECIDED } else { WITNESSED };
        // Even one pair in a large block stays visible.
        let share = (witnessed + undecided) as f64 / pairs as f64;
        let opacity = if undecided > 0 {
            1.0
        } else if witnessed > 0 {
            0.12 + 0.88 * share
        } else {
            0.0
        };
        [r, g, b, (opacity * 255.0).round() as u8]
    };
    let pixels = counts.iter().enumerate().map(pixel).collect();
    MatrixPicture { side, block, pixels }
}

impl MatrixPicture {
    /// The picture as PNG.
    ///
    /// # Errors
    ///
    /// Errors of the encoder, and a matrix without rows.
    pub fn png(&self) -> Result<Vec<u8>, png::EncodingError> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.side as u32, self.side as u32);
        encoder.set_color(png::ColorType::Rgba);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_compression(png::Compression::High);
        encoder.write_header()?.write_image_data(self.pixels.as_flattened())?;
        Ok(bytes)
    }
}

/// The picture in a page, with a legend; `order` describes rows and columns. Empty for a matrix without rows.
pub fn figure(lower: &BitMatrix, upper: &BitMatrix, order: &str) -> String {
    let picture = matrix(lower, upper);
    let Ok(png) = picture.png() else { return String::new() };
    let MatrixPicture { side, block, .. } = picture;
    // As large as whole pixels allow.
    let shown = side * (LARGEST / side.max(1)).max(1);
    let key = |[r, g, b]: [u8; 3], name: &str| {
        format!("<li><span class=\"key\" style=\"background:rgb({r},{g},{b})\"></span>{name}</li>")
    };
    let scale = match block {
        1 => format!("Each pixel is a pair; rows and columns are {order}."),
        _ => format!(
            "Each pixel is a block of {block} &times; {block} pairs. Stronger colours have more visible pairs; any undecided pair \
             gives the block its colour. Rows and columns are {order}."
        ),
    };
    format!(
        "<figure>\n<ul class=\"legend\">{}{}<li><span class=\"key\" style=\"background:var(--page)\"></span>proven hidden</li></ul>\n\
         <img class=\"matrix\" width=\"{shown}\" height=\"{shown}\" alt=\"Visibility matrix\" src=\"{}\">\n\
         <figcaption>{scale}</figcaption>\n</figure>\n",
        key(WITNESSED, "witnessed"),
        key(UNDECIDED, "undecided"),
        png_address(&png)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pixel_a_pair_where_they_have_room() {
        let (mut lower, mut upper) = (BitMatrix::new(3, 3), BitMatrix::new(3, 3));
        [(0, 0), (1, 1), (2, 2)].into_iter().for_each(|(a, b)| {
            lower.set(a, b);
            upper.set(a, b);
        });
        upper.set(0, 2);
        let picture = matrix(&lower, &upper);
        assert_eq!((picture.side, picture.block), (3, 1));
        let [r, g, b] = UNDECIDED;
        assert_eq!((picture.pixels[0][3], picture.pixels[1][3], picture.pixels[2]), (255, 0, [r, g, b, 255]));
        let png = picture.png().unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(png)).read_info().unwrap();
        let mut back = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut back).unwrap();
        assert_eq!(back, picture.pixels.as_flattened());
    }

    #[test]
    fn a_large_matrix_loses_no_undecided_pair() {
        let n = 2 * LARGEST + 2;
        let (mut lower, mut upper) = (BitMatrix::new(n, n), BitMatrix::new(n, n));
        (0..n).for_each(|a| {
            lower.set(a, a);
            upper.set(a, a);
        });
        upper.set(1000, 17);
        let picture = matrix(&lower, &upper);
        assert_eq!((picture.block, picture.side), (3, 428));
        let undecided: Vec<usize> =
            (0..428 * 428).filter(|&i| picture.pixels[i][..3] == UNDECIDED && picture.pixels[i][3] > 0).collect();
        assert_eq!(undecided, [1000 / 3 * 428 + 17 / 3]);
        // The last block is one pair, which is witnessed; others on the diagonal are 3 of 9.
        assert_eq!([picture.pixels[0][3], picture.pixels[428 * 428 - 1][3]], [105, 255]);
    }
}
