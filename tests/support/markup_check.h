/* markup_check: what holds of every page: elements nest, ids are given once, nothing comes from outside,
 * and no drawing has a number that is none. For tests only. */
#ifndef FV_TESTS_MARKUP_CHECK_H
#define FV_TESTS_MARKUP_CHECK_H

#include <stdarg.h>
#include <setjmp.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct markup {
    int depth, ids;
    char open[64][24]; /* names of the elements under way */
    char id[1024][32];
};

/* How often a part is in a text. Not by strstr, which takes the whole length each time under ASan. */
static inline int markup_count(const char *text, const char *part)
{
    int count = 0;
    size_t length = strlen(part);
    for (; *text; text++) count += *text == *part && strncmp(text, part, length) == 0;
    return count;
}

/* The value of an attribute (` name="`) in a tag, "" where it has none. */
static inline const char *markup_attribute(const char *tag, const char *attribute)
{
    static char value[1 << 16];
    const char *from = strstr(tag, attribute);
    size_t length = from ? strcspn(from += strlen(attribute), "\"") : 0;
    if (from) memcpy(value, from, length);
    value[length] = 0;
    return value;
}

/* Every opened element is closed in its turn. */
static inline void markup_check_nesting(struct markup *m, const char *tag)
{
    static const char *const empty[] = {"!doctype", "meta", "link", "img", "br"};
    bool closing = tag[0] == '/', alone = tag[strlen(tag) - 1] == '/';
    char name[24];
    size_t n = strcspn(tag + closing, " \n/");
    assert_true(n > 0 && n < sizeof name);
    memcpy(name, tag + closing, n);
    name[n] = 0;
    for (size_t i = 0; i < sizeof empty / sizeof empty[0]; i++) alone |= strcmp(empty[i], name) == 0;
    if (closing) {
        assert_true(m->depth > 0);
        assert_string_equal(m->open[--m->depth], name);
    } else if (!alone) {
        assert_true(m->depth < 64);
        memcpy(m->open[m->depth++], name, sizeof name);
    }
}

static inline void markup_check_attributes(struct markup *m, const char *tag)
{
    static const char *const links[] = {" src=\"", " href=\""};
    static const char *const numbers[] = {" x=\"",  " y=\"",  " x1=\"", " x2=\"", " y1=\"",    " y2=\"",
                                          " cx=\"", " cy=\"", " d=\"",  " r=\"",  " style=\"", " dx=\""};
    for (size_t i = 0; i < sizeof links / sizeof links[0]; i++) {
        const char *value = markup_attribute(tag, links[i]);
        if (value[0] && value[0] != '#' && strncmp(value, "data:", 5) != 0)
            fail_msg("from outside: '%s'", value);
    }
    for (size_t i = 0; i < sizeof numbers / sizeof numbers[0]; i++) {
        const char *value = markup_attribute(tag, numbers[i]);
        if (strstr(value, "nan") || strstr(value, "inf")) fail_msg("%s%s\"", numbers[i], value);
    }
    const char *id = markup_attribute(tag, " id=\"");
    if (!id[0]) return;
    assert_true(m->ids < 1024 && strlen(id) < 32);
    for (int i = 0; i < m->ids; i++) assert_string_not_equal(m->id[i], id);
    snprintf(m->id[m->ids++], 32, "%.31s", id);
}

static inline void markup_check(const char *html)
{
    static char tag[1 << 16]; /* of a longer one, an embedded picture, the beginning */
    static struct markup m;
    m.depth = m.ids = 0;
    assert_null(strstr(html, "://"));
    assert_null(strstr(html, "<script"));
    assert_null(strstr(html, "@import"));
    assert_int_equal(markup_count(html, "url("), markup_count(html, "url(#"));
    for (const char *at = html, *end; (at = strchr(at, '<')); at = end) {
        end = strchr(++at, '>');
        assert_non_null(end);
        assert_true(end > at);
        size_t length = (size_t)(end - at) < sizeof tag ? (size_t)(end - at) : sizeof tag - 1;
        memcpy(tag, at, length);
        tag[length] = 0;
        markup_check_nesting(&m, tag);
        markup_check_attributes(&m, tag);
    }
    assert_int_equal(m.depth, 0);
}

#endif
