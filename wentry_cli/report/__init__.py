"""The report: panels like the paper's, film strips with the overlay, tables, one HTML page and a PDF."""
