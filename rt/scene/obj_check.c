/* obj_check: see obj_check.h. One pass: a positive index may point ahead, so the largest one and its
 * line are kept until the counts are known. */
#include "rt/scene/obj_check.h"

#include "rt/scene/build.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { POSITION, UV, NORMAL, KINDS, CORNERS_MAX = 1000 };

struct scan {
    const char *path;
    int line;
    long count[KINDS], largest[KINDS];
    int largest_line[KINDS];
    struct fv_error *error;
};

static const struct {
    const char *keyword, *name;
    int numbers; /* at least; the others are optional and not read */
} kinds[KINDS] = {{"v", "vertex", 3}, {"vt", "texture coordinate", 1}, {"vn", "normal", 3}};

static char *skip_blanks(char *p)
{
    return p + strspn(p, " \t");
}

static int check_numbers(const struct scan *s, char *p, int kind)
{
    int n = 0;
    for (p = skip_blanks(p); *p && n < (kind == UV ? 2 : 3); p = skip_blanks(p), n++) {
        size_t length = strcspn(p, " \t");
        char *end;
        double value = strtod(p, &end);
        /* The parser knows decimal numbers only. */
        if (end != p + length || strspn(p, "+-.0123456789eE") < length || length > 60 ||
            !(fabs(value) <= FLT_MAX))
            return fv_error_set(s->error, "%s:%d: '%.*s' is not a finite number", s->path, s->line,
                                length > 40 ? 40 : (int)length, p);
        p = end;
    }
    if (n < kinds[kind].numbers)
        return fv_error_set(s->error, "%s:%d: a %s of %d numbers, needs %d", s->path, s->line,
                            kinds[kind].name, n, kinds[kind].numbers);
    return 0;
}

static int check_index(struct scan *s, int kind, long index)
{
    if (index == 0) return fv_error_set(s->error, "%s:%d: index 0, they count from 1", s->path, s->line);
    if (index < -s->count[kind])
        return fv_error_set(s->error, "%s:%d: %s index %ld, but there are %ld before it", s->path, s->line,
                            kinds[kind].name, index, s->count[kind]);
    if (index > s->largest[kind]) s->largest[kind] = index, s->largest_line[kind] = s->line;
    return 0;
}

/* v, v/vt, v//vn or v/vt/vn, several of them. */
static int check_face(struct scan *s, char *p)
{
    int corners = 0;
    for (p = skip_blanks(p); *p; p = skip_blanks(p), corners++) {
        char *token = p;
        for (int kind = POSITION; kind < KINDS; kind++) {
            bool left_out = kind == UV && *p == '/';
            char *end = p;
            long index = left_out ? 0 : strtol(p, &end, 10);
            bool bad = !left_out && (end == p || *p == ' ' || *p == '\t');
            p = end;
            if (!bad && !left_out && check_index(s, kind, index)) return -1;
            bool over = *p == 0 || *p == ' ' || *p == '\t';
            if (bad || (!over && (*p != '/' || kind == NORMAL)))
                return fv_error_set(s->error,
                                    "%s:%d: '%.40s' is no corner, must be v, v/vt, v//vn or v/vt/vn", s->path,
                                    s->line, token);
            if (over) break;
            p++;
        }
    }
    if (corners > CORNERS_MAX)
        return fv_error_set(s->error, "%s:%d: a polygon of %d corners, at most %d are read", s->path, s->line,
                            corners, CORNERS_MAX);
    return 0;
}

static void join_words(char *name)
{
    name = skip_blanks(name);
    size_t length = strlen(name);
    while (length > 0 && strchr(" \t", name[length - 1])) length--;
    for (size_t i = 0; i < length; i++)
        if (name[i] == ' ' || name[i] == '\t') name[i] = '_';
}

/* What follows the keyword, or NULL where the line begins with another word. */
static char *after_keyword(char *line, const char *keyword)
{
    size_t n = strlen(keyword);
    return strncmp(line, keyword, n) == 0 && (line[n] == ' ' || line[n] == '\t' || line[n] == 0) ? line + n
                                                                                                 : NULL;
}

static int check_line(struct scan *s, char *line)
{
    char *p;
    for (int kind = POSITION; kind < KINDS; kind++) {
        if (!(p = after_keyword(line, kinds[kind].keyword))) continue;
        if (++s->count[kind] > FV_ELEMENTS_MAX)
            return fv_error_set(s->error, "%s:%d: more than %d of one kind", s->path, s->line,
                                FV_ELEMENTS_MAX);
        return check_numbers(s, p, kind);
    }
    if ((p = after_keyword(line, "f"))) return check_face(s, p);
    if ((p = after_keyword(line, "usemtl"))) join_words(p);
    else if (!after_keyword(line, "s") && !after_keyword(line, "mtllib")) *line = '#';
    return 0;
}

/* Newlines of other systems become ours: the parser takes a lone carriage return for one too. */
static void unify_newlines(char *p)
{
    for (; *p; p++)
        if (*p == '\r') *p = p[1] == '\n' ? ' ' : '\n';
}

/* The end of the line at p, blanks before it made newlines. Where it ends in a backslash the next line
 * is joined to it, and *line raised. */
static char *end_of_line(char *p, int *line)
{
    char *end = p + strcspn(p, "\n"), *last;
    for (;;) {
        for (last = end; last > p && strchr(" \t", last[-1]); last--) last[-1] = '\n';
        if (last == p || last[-1] != '\\' || !*end) return end;
        for (last--; last <= end; last++) *last = ' ';
        ++*line;
        end = last + strcspn(last, "\n");
    }
}

int fv_obj_check(const char *path, char *text, size_t size, struct fv_error *error)
{
    struct scan s = {.path = path, .error = error};
    if (memchr(text, 0, size)) return fv_error_set(error, "%s: not a text file", path);
    unify_newlines(text);
    for (char *p = text, *newline; *p; p = newline + (*newline != 0)) {
        int joined = 0;
        s.line++;
        newline = end_of_line(p, &joined);
        char *line = skip_blanks(p), *end = line + strcspn(line, "\n"), was = *end;
        *end = 0;
        if (*line && check_line(&s, line)) return -1;
        *end = was;
        s.line += joined;
    }
    for (int kind = POSITION; kind < KINDS; kind++)
        if (s.largest[kind] > s.count[kind])
            return fv_error_set(error, "%s:%d: %s index %ld, but there are %ld", path, s.largest_line[kind],
                                kinds[kind].name, s.largest[kind], s.count[kind]);
    return 0;
}

void fv_mtl_prepare(char *text)
{
    while (*text) {
        char *line = skip_blanks(text), *newline = line + strcspn(line, "\r\n"), was = *newline, *name;
        *newline = 0;
        if ((name = after_keyword(line, "newmtl"))) join_words(name);
        *newline = was;
        text = newline + (was != 0);
    }
}
