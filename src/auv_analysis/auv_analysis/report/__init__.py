"""Results, tables, plots and the HTML document that shows them; knows no study and no paper."""
