/* obj: Wavefront OBJ and MTL. tinyobjloader parses and cuts polygons into triangles, after
 * obj_check.c has found what it would let pass; here its result becomes a scene. */
#define TINYOBJLOADER_IMPLEMENTATION
#include <tiny_obj_loader.h>

extern "C" {
#include "platform/files.h"
#include "platform/log.h"
}
#include "rt/scene/build.h"
extern "C" {
#include "rt/scene/obj_check.h"
}

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <sstream>
#include <unordered_map>

namespace
{

const size_t TEXT_MOST = size_t(4) << 30, MTL_MOST = size_t(64) << 20, PICTURE_MOST = size_t(256) << 20;

/* Bytes of a file, freed at the end of their scope. */
struct file {
    char *bytes = nullptr;
    size_t size = 0;
    file() = default;
    file(const file &) = delete;
    file &operator=(const file &) = delete;
    ~file()
    {
        free(bytes);
    }
};

/* A stream's view of memory that is there already. */
struct memory : std::streambuf {
    explicit memory(const file &f)
    {
        setg(f.bytes, f.bytes, f.bytes + f.size);
    }
};

/* Reads MTL files beside the OBJ and makes texture names paths. A missing one is no error. */
class mtl_reader : public tinyobj::MaterialReader
{
  public:
    explicit mtl_reader(const char *obj_path)
    {
        fv_path_folder(folder, obj_path);
    }

    bool operator()(const std::string &name, std::vector<tinyobj::material_t> *materials,
                    std::map<std::string, int> *by_name, std::string *, std::string *) override
    {
        file text;
        fv_error why;
        char path[FV_PATH_MAX] = "", beside[FV_PATH_MAX];
        if (fv_path_join(path, folder, name.c_str()) ||
            fv_file_read(path, MTL_MOST, &text.bytes, &text.size, &why)) {
            fv_log("%s: these materials are not there: what uses them is grey",
                   path[0] ? path : name.c_str());
            return false;
        }
        fv_mtl_prepare(text.bytes);
        memory bytes(text);
        std::istream stream(&bytes);
        size_t first = materials->size();
        std::string warning, error;
        tinyobj::LoadMtl(by_name, materials, &stream, &warning, &error);
        fv_path_folder(beside, path);
        for (size_t i = first; i < materials->size(); i++) {
            tinyobj::material_t &m = (*materials)[i];
            for (std::string *texture :
                 {&m.diffuse_texname, &m.alpha_texname, &m.bump_texname, &m.normal_texname}) {
                std::replace(texture->begin(), texture->end(), '\\', '/');
                if (!texture->empty() && (*texture)[0] != '/')
                    *texture = std::string(beside) + "/" + *texture;
            }
        }
        return true;
    }

  private:
    char folder[FV_PATH_MAX];
};

struct picture {
    uint8_t *pixels = nullptr;
    int width = 0, height = 0, channels = 0;
    picture() = default;
    picture(const picture &) = delete;
    picture &operator=(const picture &) = delete;
    ~picture()
    {
        free(pixels);
    }
};

/* A height map is grey, whatever the number of its channels. */
bool is_grey(const picture &p)
{
    if (p.channels < 3) return true;
    for (size_t i = 0; i < size_t(p.width) * size_t(p.height); i++) {
        const uint8_t *c = p.pixels + i * size_t(p.channels);
        if (abs(c[0] - c[1]) > 8 || abs(c[1] - c[2]) > 8) return false;
    }
    return true;
}

/* The slopes of a height map as a normal map. MTL gives no unit: the full range of grey is taken to be
 * `strength` (-bm) hundredths of the picture's width. */
std::vector<uint8_t> normals_of_heights(const picture &p, double strength)
{
    std::vector<uint8_t> out(size_t(p.width) * size_t(p.height) * 3);
    const double rise = strength * 0.01 * p.width / 255 / 2; /* of a central difference, in pixels a pixel */
    auto height = [&p](int x, int y) {
        x = (x + p.width) % p.width;
        y = (y + p.height) % p.height;
        return double(p.pixels[(size_t(y) * size_t(p.width) + size_t(x)) * size_t(p.channels)]);
    };
    uint8_t *at = out.data();
    for (int y = 0; y < p.height; y++) {
        for (int x = 0; x < p.width; x++, at += 3) {
            double n[3] = {rise * (height(x - 1, y) - height(x + 1, y)),
                           rise * (height(x, y + 1) - height(x, y - 1)), 1};
            double length = std::sqrt(n[0] * n[0] + n[1] * n[1] + 1);
            for (int i = 0; i < 3; i++) at[i] = uint8_t(std::lrint((n[i] / length + 1) * 127.5));
        }
    }
    return out;
}

class obj_reader
{
  public:
    obj_reader(fv_build *b, const char *p, double s, fv_error *e) : build(b), path(p), scale(s), error(e)
    {
    }
    int read();

  private:
    fv_build *build;
    const char *path;
    double scale;
    fv_error *error;
    tinyobj::attrib_t attributes;
    std::vector<tinyobj::shape_t> shapes;
    std::vector<tinyobj::material_t> materials;
    std::map<std::string, int> textures; /* by use and path */
    std::vector<int> made; /* of each material: its index in the build, plus 1; the last is grey */

    int parse();
    int texture(const std::string &name, fv_texel kind, double strength, const std::string &material,
                int *out);
    int material(int id, int *out);
    int add(const tinyobj::mesh_t &mesh);
};

int obj_reader::parse()
{
    file text;
    if (fv_file_read(path, TEXT_MOST, &text.bytes, &text.size, error)) return -1;
    if (fv_obj_check(path, text.bytes, text.size, error)) return -1;
    memory bytes(text);
    std::istream stream(&bytes);
    std::string warning, failure;
    mtl_reader reader(path);
    if (!tinyobj::LoadObj(&attributes, &shapes, &materials, &warning, &failure, &stream, &reader, true,
                          false))
        return fv_error_set(error, "%s: %.*s", path, int(strcspn(failure.c_str(), "\n")), failure.c_str());
    /* Where no MTL file was found that has been said already. */
    size_t missing = warning.find("material [ '");
    if (missing != std::string::npos && !materials.empty()) {
        std::string name = warning.substr(missing + 12, warning.find("' ]", missing) - missing - 12);
        fv_log("%s: material %.60s is not in its MTL file: what uses it is grey", path, name.c_str());
    }
    return 0;
}

int obj_reader::texture(const std::string &name, fv_texel kind, double strength, const std::string &material,
                        int *out)
{
    if (name.empty()) return 0;
    std::ostringstream key;
    key << kind << ' ' << strength << ' ' << name;
    auto found = textures.find(key.str());
    if (found != textures.end()) {
        *out = found->second;
        return 0;
    }
    file bytes;
    fv_error why;
    picture p;
    if (fv_file_read(name.c_str(), PICTURE_MOST, &bytes.bytes, &bytes.size, &why) ||
        fv_image_decode(reinterpret_cast<uint8_t *>(bytes.bytes), bytes.size, name.c_str(), &p.pixels,
                        &p.width, &p.height, &p.channels, &why))
        return fv_error_set(error, "%s: material %.60s: %.400s", path, material.c_str(), why.text);
    if (kind == FV_TEXEL_NORMAL && is_grey(p)) {
        std::vector<uint8_t> normals = normals_of_heights(p, strength);
        *out = fv_build_texture(build, kind, normals.data(), p.width, p.height, 3, 0);
    } else {
        *out = fv_build_texture(build, kind, p.pixels, p.width, p.height, p.channels, 0.5f);
    }
    textures[key.str()] = *out;
    return 0;
}

bool finite(const tinyobj::material_t &m)
{
    double sum = double(m.shininess) + m.ior + m.dissolve + m.bump_texopt.bump_multiplier;
    for (int i = 0; i < 3; i++)
        sum += double(m.diffuse[i]) + m.specular[i] + m.transmittance[i] + m.emission[i];
    return std::isfinite(sum);
}

float clamp01(float x)
{
    return std::min(std::max(x, 0.0f), 1.0f);
}

/* What of the light goes through. Tf has two meanings: coloured, it is the filter that Wavefront
 * defined; grey, it is what 3ds Max and Maya write there, the opacity, 1 being opaque. d < 1 is the
 * share that passes; it, and a grey Tf, take on the hue of Kd. illum 4 and 9 are glass, 6 and 7 bend
 * the light too, by Ni; other glass is a thin pane that does not. Ks is not normalised in MTL: what
 * lets light through gets the highlight of glass, a reflectance of 0.04 at most. */
void transmit(const tinyobj::material_t &in, fv_material *out)
{
    const float *tf = in.transmittance, most = std::max({in.diffuse[0], in.diffuse[1], in.diffuse[2]});
    bool coloured = std::max({tf[0], tf[1], tf[2]}) - std::min({tf[0], tf[1], tf[2]}) > 0.02f;
    bool bends = in.illum == 6 || in.illum == 7, glass = bends || in.illum == 4 || in.illum == 9;
    float share = 1 - clamp01(in.dissolve);
    out->ior = bends ? in.ior : 1;
    if (share == 0 && glass) {
        if (coloured) share = 1;
        else if (tf[0] > 0 && tf[0] < 1) share = 1 - tf[0];
        else if (bends) share = 1;
    }
    if (share == 0) return;
    for (int i = 0; i < 3; i++) {
        float hue = most > 0 ? clamp01(in.diffuse[i] / most) : 1;
        out->transmission[i] = share * (coloured ? clamp01(tf[i]) : hue);
        out->diffuse[i] = std::min(clamp01(in.dissolve) * out->diffuse[i], 1 - out->transmission[i]);
        out->specular[i] = std::min(out->specular[i], 0.04f);
    }
}

/* The material of a face, made when first used; -1 is none. */
int obj_reader::material(int id, int *out)
{
    int &slot = made[id >= 0 ? size_t(id) : materials.size()];
    if (slot == 0) {
        fv_material m = fv_material_default();
        if (id >= 0) {
            const tinyobj::material_t &in = materials[size_t(id)];
            if (!finite(in))
                return fv_error_set(error, "%s: material %.60s holds a number that is not finite", path,
                                    in.name.c_str());
            bool reflects = in.illum == 3 || in.illum == 5;
            bool mirror = reflects && std::max({in.specular[0], in.specular[1], in.specular[2]}) >= 0.5f;
            for (int i = 0; i < 3; i++) {
                m.diffuse[i] = clamp01(in.diffuse[i]);
                (mirror ? m.mirror : m.specular)[i] = clamp01(in.specular[i]);
                m.emission[i] = std::max(in.emission[i], 0.0f);
            }
            m.shininess = in.shininess;
            transmit(in, &m);
            const std::string &bump = in.normal_texname.empty() ? in.bump_texname : in.normal_texname;
            if (texture(in.diffuse_texname, FV_TEXEL_COLOUR, 0, in.name, &m.base_texture) ||
                texture(in.alpha_texname, FV_TEXEL_ALPHA, 0, in.name, &m.alpha_texture) ||
                texture(bump, FV_TEXEL_NORMAL, in.bump_texopt.bump_multiplier, in.name, &m.normal_texture))
                return -1;
        }
        slot = fv_build_material(build, &m) + 1;
    }
    *out = slot - 1;
    return 0;
}

/* Vertex normals within smoothing groups: those of the faces around, weighted by their angle
 * (Thuermer and Wuethrich, "Computing Vertex Normals from Polygonal Facets", 1998). Only for
 * corners that bring none. Outside of groups faces are flat. */
class smoother
{
  public:
    struct sum {
        double v[3];
    };

    smoother(const tinyobj::attrib_t &attributes, const tinyobj::mesh_t &mesh)
    {
        for (size_t t = 0; t < mesh.smoothing_group_ids.size(); t++)
            if (mesh.smoothing_group_ids[t])
                add(attributes, &mesh.indices[3 * t], mesh.smoothing_group_ids[t]);
    }

    const sum &at(int vertex, unsigned group)
    {
        return normals[key(vertex, group)];
    }

  private:
    std::unordered_map<uint64_t, sum> normals;

    static uint64_t key(int vertex, unsigned group)
    {
        return uint64_t(group) << 32 | unsigned(vertex);
    }

    void add(const tinyobj::attrib_t &attributes, const tinyobj::index_t *corner, unsigned group)
    {
        double p[3][3], n[3];
        for (int k = 0; k < 3; k++)
            for (int i = 0; i < 3; i++)
                p[k][i] = attributes.vertices[size_t(corner[k].vertex_index) * 3 + size_t(i)];
        for (int i = 0; i < 3; i++) {
            int j = (i + 1) % 3, k = (i + 2) % 3;
            n[i] = (p[1][j] - p[0][j]) * (p[2][k] - p[0][k]) - (p[1][k] - p[0][k]) * (p[2][j] - p[0][j]);
        }
        double length = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        if (!(length > 0)) return;
        for (int k = 0; k < 3; k++) {
            double dot = 0;
            for (int i = 0; i < 3; i++) dot += (p[(k + 1) % 3][i] - p[k][i]) * (p[(k + 2) % 3][i] - p[k][i]);
            double angle = std::atan2(length, dot);
            sum &at = normals[key(corner[k].vertex_index, group)];
            for (int i = 0; i < 3; i++) at.v[i] += angle * n[i] / length;
        }
    }
};

/* Corners of equal position, texture coordinate and normal become one vertex. */
int obj_reader::add(const tinyobj::mesh_t &mesh)
{
    struct vertex {
        uint32_t index, next; /* in the build; the next of the same position, 0 the last */
        int uv, normal;
        unsigned group;
    };
    std::vector<vertex> vertices(1);
    std::vector<uint32_t> first(attributes.vertices.size() / 3);
    smoother smooth(attributes, mesh);
    for (size_t t = 0; t < mesh.material_ids.size(); t++) {
        uint32_t corner[3];
        for (size_t k = 0; k < 3; k++) {
            const tinyobj::index_t &i = mesh.indices[3 * t + k];
            unsigned group = i.normal_index < 0 ? mesh.smoothing_group_ids[t] : 0;
            uint32_t at = first[size_t(i.vertex_index)];
            while (at && !(vertices[at].uv == i.texcoord_index && vertices[at].normal == i.normal_index &&
                           vertices[at].group == group))
                at = vertices[at].next;
            if (!at) {
                fv_vertex v = {};
                for (size_t j = 0; j < 3; j++) {
                    v.position[j] = float(attributes.vertices[size_t(i.vertex_index) * 3 + j] * scale);
                    if (i.normal_index >= 0) v.normal[j] = attributes.normals[size_t(i.normal_index) * 3 + j];
                    else if (group) v.normal[j] = float(smooth.at(i.vertex_index, group).v[j]);
                }
                if (i.texcoord_index >= 0) {
                    v.uv[0] = attributes.texcoords[size_t(i.texcoord_index) * 2];
                    v.uv[1] = 1 - attributes.texcoords[size_t(i.texcoord_index) * 2 + 1];
                }
                at = uint32_t(vertices.size());
                vertices.push_back({fv_build_vertex(build, &v), first[size_t(i.vertex_index)],
                                    i.texcoord_index, i.normal_index, group});
                first[size_t(i.vertex_index)] = at;
            }
            corner[k] = vertices[at].index;
        }
        int index = 0;
        if (material(mesh.material_ids[t], &index)) return -1;
        fv_build_triangle(build, corner[0], corner[1], corner[2], index);
    }
    return 0;
}

int obj_reader::read()
{
    if (parse()) return -1;
    made.assign(materials.size() + 1, 0);
    for (const tinyobj::shape_t &shape : shapes)
        if (add(shape.mesh)) return -1;
    return 0;
}

} // namespace

extern "C" int fv_obj_read(struct fv_build *build, const char *path, double scale, struct fv_error *error)
{
    obj_reader reader(build, path, scale, error);
    return reader.read();
}
