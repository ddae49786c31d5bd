// Visibility cubes by Embree 3, for comparison: benches/cubes.rs builds this where g++ and Embree's headers are, and runs it.
//
//     g++ -O3 -march=native -o cubes cubes.cpp -lembree3
//     ./cubes IN OUT REPEATS
//
// IN: u32 triangles, eyes, size; f32 corners (9 a triangle), eyes (3 each). OUT: f64 milliseconds of each eye (the least of REPEATS), then
// u32 ids, `6 * size * size` an eye. Rays go in packets of eight, four columns by two rows, marked as coherent, on one thread. Faces and
// pixels are those of `CubeView`.

#include <embree3/rtcore.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <vector>

template <class T> static std::vector<T> take(FILE* file, size_t count) {
    std::vector<T> out(count);
    if (fread(out.data(), sizeof(T), count, file) != count) {
        fprintf(stderr, "the input is short\n");
        exit(2);
    }
    return out;
}

int main(int count, char** arguments) {
    FILE* in = count == 4 ? fopen(arguments[1], "rb") : nullptr;
    if (!in) {
        fprintf(stderr, "cubes IN OUT REPEATS\n");
        return 2;
    }
    const std::vector<uint32_t> head = take<uint32_t>(in, 3);
    const uint32_t triangles = head[0], eyes = head[1], size = head[2];
    const std::vector<float> corners = take<float>(in, 9 * size_t(triangles));
    const std::vector<float> places = take<float>(in, 3 * size_t(eyes));
    fclose(in);

    RTCDevice device = rtcNewDevice(nullptr);
    RTCScene scene = rtcNewScene(device);
    RTCGeometry mesh = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    float* vertices = (float*)rtcSetNewGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, 3 * size_t(triangles));
    uint32_t* indices = (uint32_t*)rtcSetNewGeometryBuffer(mesh, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, triangles);
    std::copy(corners.begin(), corners.end(), vertices);
    for (size_t i = 0; i < 3 * size_t(triangles); i++) indices[i] = uint32_t(i);
    rtcCommitGeometry(mesh);
    rtcAttachGeometry(scene, mesh);
    rtcReleaseGeometry(mesh);
    rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_HIGH);
    rtcCommitScene(scene);

    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    const float infinity = std::numeric_limits<float>::infinity();
    const size_t pixels = 6 * size_t(size) * size;
    std::vector<uint32_t> ids(pixels * eyes);
    std::vector<double> times(eyes, infinity);
    for (int repeat = 0; repeat < atoi(arguments[3]); repeat++) {
        for (uint32_t e = 0; e < eyes; e++) {
            const auto start = std::chrono::steady_clock::now();
            uint32_t* out = &ids[pixels * e];
            for (int face = 0; face < 6; face++) {
                const int w = face / 2, x = (w + 1) % 3, y = (w + 2) % 3;
                for (uint32_t row = 0; row < size; row += 2) {
                    for (uint32_t column = 0; column < size; column += 4) {
                        alignas(32) int valid[8];
                        RTCRayHit8 rays;
                        float* directions[3] = {rays.ray.dir_x, rays.ray.dir_y, rays.ray.dir_z};
                        for (int i = 0; i < 8; i++) {
                            const uint32_t c = column + i % 4, r = row + i / 4;
                            valid[i] = c < size && r < size ? -1 : 0;
                            rays.ray.org_x[i] = places[3 * e];
                            rays.ray.org_y[i] = places[3 * e + 1];
                            rays.ray.org_z[i] = places[3 * e + 2];
                            directions[w][i] = face % 2 ? -1.0f : 1.0f;
                            directions[x][i] = (2.0f * c + 1.0f) / size - 1.0f;
                            directions[y][i] = (2.0f * r + 1.0f) / size - 1.0f;
                            rays.ray.tnear[i] = 0.0f;
                            rays.ray.tfar[i] = infinity;
                            rays.ray.time[i] = 0.0f;
                            rays.ray.mask[i] = ~0u;
                            rays.ray.id[i] = i;
                            rays.ray.flags[i] = 0;
                            rays.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
                            rays.hit.primID[i] = ~0u;
                        }
                        rtcIntersect8(valid, scene, &context, &rays);
                        for (int i = 0; i < 8; i++) {
                            const uint32_t c = column + i % 4, r = row + i / 4;
                            if (valid[i]) out[(size_t(face) * size + r) * size + c] = rays.hit.primID[i];
                        }
                    }
                }
            }
            const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - start;
            times[e] = std::min(times[e], took.count());
        }
    }
    FILE* file = fopen(arguments[2], "wb");
    if (!file) return 2;
    fwrite(times.data(), sizeof(double), times.size(), file);
    fwrite(ids.data(), sizeof(uint32_t), ids.size(), file);
    fclose(file);
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
    return 0;
}
