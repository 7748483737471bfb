/* moving: see moving.h. Rows are parted by commas, words by blanks; the first word says what moves, each
 * further keyword is followed by its numbers. */
#include "rt/scene/moving.h"

#include "rt/scene/path.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A row being read. */
struct row {
    const char *at; /* what is left of it */
    int number;     /* from 1 */
    char word[FV_NAME_MAX];
    struct fv_moving *moving;
    bool has[8]; /* of the keywords */
    struct fv_error *error;
};

/* The next word into row->word; false at the row's end. One that is too long is cut, and then is none that
 * anything knows. */
static bool next_word(struct row *row)
{
    row->at += strspn(row->at, " \t");
    size_t length = strcspn(row->at, " \t,"), kept = length < FV_NAME_MAX ? length : FV_NAME_MAX - 1;
    memcpy(row->word, row->at, kept);
    row->word[kept] = 0;
    row->at += length;
    return length > 0;
}

static int refuse(struct row *row, const char *what, const char *right)
{
    return fv_config_error(row->error, "scene.moving", "row %d: %.60s%s%.120s", row->number, row->word, what,
                           right);
}

/* `count` numbers behind a keyword. */
static int read_numbers(struct row *row, const char *keyword, int count, double min, double max, double *out)
{
    for (int i = 0; i < count; i++) {
        char *end;
        if (!next_word(row))
            return fv_config_error(row->error, "scene.moving", "row %d: %s needs %d numbers, has %d", row->number,
                                   keyword, count, i);
        out[i] = strtod(row->word, &end);
        if (end == row->word || *end) return refuse(row, ": must be a number, behind ", keyword);
        if (!(out[i] >= min && out[i] <= max))
            return fv_config_error(row->error, "scene.moving", "row %d: %s %.60s: must be from %g to %g", row->number,
                                   keyword, row->word, min, max);
    }
    return 0;
}

static int read_sphere(struct row *row)
{
    row->moving->body = FV_BODY_SPHERE;
    return read_numbers(row, "sphere", 1, 1e-3, 1e6, row->moving->size_m);
}

static int read_box(struct row *row)
{
    row->moving->body = FV_BODY_BOX;
    return read_numbers(row, "box", 3, 1e-3, 1e6, row->moving->size_m);
}

static int read_light(struct row *row)
{
    row->moving->body = FV_BODY_LIGHT;
    return read_numbers(row, "light", 3, 0, 1e9, row->moving->intensity);
}

static int read_node(struct row *row)
{
    row->moving->body = FV_BODY_NODE;
    if (!next_word(row)) return refuse(row, "node needs a name", "");
    memcpy(row->moving->name, row->word, sizeof row->word);
    return 0;
}

static int read_colour(struct row *row)
{
    return read_numbers(row, "colour", 3, 0, 1, row->moving->colour);
}

static int read_way(struct row *row)
{
    struct fv_moving *m = row->moving;
    if (m->ways == FV_WAYS_MAX)
        return fv_config_error(row->error, "scene.moving", "row %d: more than %d way points", row->number,
                               FV_WAYS_MAX);
    return read_numbers(row, "at", 4, -FV_WAY_LARGEST, FV_WAY_LARGEST, m->way[m->ways++]);
}

static int read_seconds(struct row *row)
{
    return read_numbers(row, "in", 1, 0, 1e6, &row->moving->seconds);
}

static int read_spin(struct row *row)
{
    return read_numbers(row, "spin", 3, -1e6, 1e6, row->moving->spin_deg_s);
}

static const struct {
    const char *name;
    int (*read)(struct row *row);
    bool body, often; /* body: the first word of a row, and only that; often: may come more than once */
} keywords[] = {{"sphere", read_sphere, true, false},  {"box", read_box, true, false},
                {"light", read_light, true, false},    {"node", read_node, true, false},      {"colour", read_colour, false, false},
                {"at", read_way, false, true},         {"in", read_seconds, false, false},
                {"spin", read_spin, false, false}};
enum { KEYWORDS = sizeof keywords / sizeof keywords[0] };

static int read_keyword(struct row *row, bool first)
{
    for (int k = 0; k < KEYWORDS; k++) {
        if (keywords[k].body != first || strcmp(keywords[k].name, row->word) != 0) continue;
        if (row->has[k] && !keywords[k].often) return refuse(row, " is there twice", "");
        row->has[k] = true;
        return keywords[k].read(row);
    }
    return refuse(row, first ? ": must begin with sphere, box, light or node" : ": must be colour, at, in or spin", "");
}

static int read_row(struct row *row)
{
    struct fv_moving *m = row->moving;
    for (bool first = true; next_word(row); first = false)
        if (read_keyword(row, first)) return -1;
    if (m->body != FV_BODY_NODE && m->ways == 0)
        return fv_config_error(row->error, "scene.moving", "row %d: says not where: needs at X Y Z YAW", row->number);
    if (m->ways > 1 && m->seconds < 0)
        return fv_config_error(row->error, "scene.moving", "row %d: says not in what time: needs in SECONDS",
                               row->number);
    m->seconds = fmax(m->seconds, 0);
    return 0;
}

int fv_moving_read(const struct fv_config *config, struct fv_moving *moving, struct fv_error *error)
{
    int count = 0, number = 0;
    for (const char *at = config->scene_moving; *at; at += *at == ',') {
        struct row row = {.at = at, .number = ++number, .error = error};
        at += strspn(at, " \t");
        if (*at && *at != ',') {
            if (count == FV_MOVING_MAX)
                return fv_config_error(error, "scene.moving", "row %d: at most %d rows are possible", number,
                                       FV_MOVING_MAX);
            row.moving = &moving[count];
            moving[count] = (struct fv_moving){.colour = {0.7, 0.7, 0.7}, .seconds = -1};
            if (read_row(&row)) return -1;
            for (int i = 0; i < count; i++)
                if (moving[i].body == FV_BODY_NODE && moving[count].body == FV_BODY_NODE &&
                    strcmp(moving[i].name, moving[count].name) == 0)
                    return fv_config_error(error, "scene.moving", "row %d: node %.100s moves already", number,
                                           moving[i].name);
            count++;
            at = row.at;
        }
    }
    return count;
}

bool fv_moving_named(const struct fv_moving *m, const char *name)
{
    const char *wanted = m->name;
    for (; *wanted && *name; wanted++, name++) {
        bool unwritable = (unsigned char)*name <= ' ' || *name == ',' || *name == ';';
        if (*wanted != *name && !(*wanted == '_' && unwritable)) return false;
    }
    return m->body == FV_BODY_NODE && !*wanted && !*name;
}

void fv_moving_pose(const struct fv_moving *m, int64_t t_ns, struct fv_pose *pose)
{
    const double degree = 3.14159265358979323846 / 180;
    double way[4] = {0}, turned[4], spin[3] = {0};
    const double *s = m->spin_deg_s, speed_deg_s = sqrt(s[0] * s[0] + s[1] * s[1] + s[2] * s[2]);
    if (m->ways > 0) fv_path_at(m->way[0], m->ways, 4, m->seconds, t_ns, way);
    double angle_deg = fmod(speed_deg_s * ((double)t_ns * 1e-9), 360);
    for (int i = 0; i < 3; i++) {
        pose->position_m[i] = m->origin_m[i] + way[i];
        if (speed_deg_s > 0) spin[i] = s[i] / speed_deg_s * angle_deg * degree;
    }
    fv_quat_from_yaw_pitch_roll(way[3] * degree, 0, 0, pose->rotation);
    fv_quat_from_vector(spin, turned);
    fv_quat_multiply(pose->rotation, turned, pose->rotation);
    fv_quat_normalise(pose->rotation);
}
