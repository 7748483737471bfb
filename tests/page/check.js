// Runs inside a report page, once it is loaded: `findings` says what is wrong with it, one a line, and at
// the end how much was looked at.
var findings = 'the page was not looked at';
addEventListener('load', () => {
    const found = [], width = window.innerWidth;
    const find = (what, element) => found.push(what + ': ' + (element.outerHTML || '').slice(0, 160));
    const apart = (a, b) => a.right <= b.left + 1 || b.right <= a.left + 1 || a.bottom <= b.top + 1 || b.bottom <= a.top + 1;
    const empty = box => !(box.width > 0 || box.height > 0);
    const root = document.documentElement;

    if (width !== EXPECTED_WIDTH) found.push(`the window is ${width} wide, not ${EXPECTED_WIDTH}`);
    if (root.scrollWidth > width) found.push(`the page is ${root.scrollWidth} wide in a window of ${width}`);

    const plots = [...document.querySelectorAll('figure.plot')];
    for (const plot of plots) {
        const drawing = plot.querySelector('svg'), area = drawing.getBoundingClientRect();
        const curves = [...plot.querySelectorAll('path')].filter(path => path.getAttribute('d'));
        if (area.width < 150 || area.height < 50) find(`a plot of ${area.width} x ${area.height}`, plot);
        if (!curves.length) find('a plot without curves', plot);
        for (const curve of curves) if (empty(curve.getBoundingClientRect())) find('an empty curve', curve);
        for (const mark of plot.querySelectorAll('use'))
            if (empty(mark.getBoundingClientRect())) find('an empty marker', mark);
        /* A method's markers reach as far as its curve does. */
        for (const curve of plot.querySelectorAll('path.curve')) {
            const reach = curve.getBoundingClientRect(), slot = curve.classList[1];
            const marks = [...plot.querySelectorAll(`.${slot}.point use`)].map(mark => mark.getBoundingClientRect());
            const x = marks.map(box => (box.left + box.right) / 2), y = marks.map(box => (box.top + box.bottom) / 2);
            const off = Math.max(Math.abs(Math.min(...x) - reach.left), Math.abs(Math.max(...x) - reach.right),
                                 Math.abs(Math.min(...y) - reach.top), Math.abs(Math.max(...y) - reach.bottom));
            if (marks.length && off > 3) find(`markers ${off} beside their curve`, curve);
        }
        const beside = [...drawing.querySelectorAll(':scope > text, .grid text'), plot.querySelector('figcaption')];
        const boxes = beside.map(text => text.getBoundingClientRect());
        boxes.forEach((box, i) => {
            if (empty(box)) find('an empty text', beside[i]);
            if (!apart(box, area)) find('text over the plot', beside[i]);
            if (box.left < 0 || box.right > width + 1) find('text cut off', beside[i]);
            for (let k = 0; k < i; k++) if (!apart(box, boxes[k])) find('texts over each other', beside[i]);
        });
    }
    /* The number of curves in each plot that shows methods is that of its section's or scene's legend. */
    for (const legend of document.querySelectorAll('section > .legend')) {
        const methods = legend.querySelectorAll('use').length;
        for (const plot of legend.parentElement.querySelectorAll('.plot'))
            if (plot.querySelectorAll('path.curve').length !== methods) find(`not ${methods} curves`, plot);
    }
    const images = [...document.images];
    for (const image of images) if (!image.complete || !image.naturalWidth) find('an image not loaded', image);
    const texts = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
    while (texts.nextNode()) {
        const parent = texts.currentNode.parentElement;
        if (!texts.currentNode.data.trim() || parent.closest('script, title, .hidden')) continue;
        if (parseFloat(getComputedStyle(parent).fontSize) < 11) find('small print', parent);
        const range = document.createRange();
        range.selectNodeContents(texts.currentNode);
        const box = range.getBoundingClientRect();
        if (!parent.closest('.scroll') && (box.left < 0 || box.right > width + 1)) find('text beside the page', parent);
    }
    found.push(`looked at: ${plots.length} plots, ${images.length} images.`);
    findings = found.join('\n');
});
