// The only table of texts: English, then German, Chinese, Japanese.

export const TABLE = {
  "Colour channel": ["Farbkanal", "颜色通道", "カラーチャンネル"],
  "Farthest depth, mm": ["Größte Tiefe, mm", "最大深度，mm", "最大深度, mm"],
  "Lens terms": ["Terme der Linse", "镜头畸变项", "レンズ歪みの項"],
  "Mount of the camera": ["Befestigung der Kamera", "相机安装方式", "カメラの取り付け"],
  "Nearest depth, mm": ["Kleinste Tiefe, mm", "最小深度，mm", "最小深度, mm"],
  "None. --mqtt URI publishes state, jobs and results; --modbus ADDR serves registers to a PLC.": [
    "Keine. --mqtt URI veröffentlicht Zustand, Aufträge, Ergebnisse; --modbus ADDR bietet einer SPS Register.",
    "无。--mqtt URI 发布状态、任务和结果；--modbus ADDR 向 PLC 提供寄存器。",
    "なし。--mqtt URI は状態・ジョブ・結果を発行し、--modbus ADDR は PLC にレジスターを提供します。"
  ],
  "Options": ["Optionen", "选项", "オプション"],
  "Pose file": ["Posendatei", "位姿文件", "姿勢ファイル"],
  "Run on": ["Rechnen auf", "运行设备", "実行先"],
  "Scatter of the robot, degrees": [
    "Streuung des Roboters, Grad",
    "机器人散布，度",
    "ロボットのばらつき, 度"
  ],
  "Scatter of the robot, mm": [
    "Streuung des Roboters, mm",
    "机器人散布，mm",
    "ロボットのばらつき, mm"
  ],
  "Shape of the board": ["Form der Tafel", "标定板形状", "ボードの形状"],
  "Skew": ["Scherung", "倾斜", "スキュー"],
  "Working distance, mm": ["Arbeitsabstand, mm", "工作距离，mm", "作業距離, mm"],
  "as the station": ["wie die Station", "与工作站一致", "ステーションに従う"],
  "connected": ["verbunden", "已连接", "接続中"],
  "waits for other programs": [
    "wartet auf andere Programme",
    "等待其他程序",
    "他のプログラムを待機中"
  ],
  "Door": ["Zugang", "接口", "接続口"],
  "Connected programs": ["Verbundene Programme", "已连接的程序", "接続中のプログラム"],
  "Messages": ["Meldungen", "消息数", "メッセージ数"],
  "Messages a second": ["Meldungen je Sekunde", "每秒消息数", "毎秒のメッセージ数"],
  "Not sent or refused": ["Nicht gesendet oder abgelehnt", "未发送或被拒绝", "未送信または拒否"],
  "Last error": ["Letzter Fehler", "最近的错误", "最後のエラー"],
  "Connections": ["Verbindungen", "连接", "接続"],
  "Address": ["Adresse", "地址", "アドレス"],
  "1280×960 has four times the pixels of 640×480. Other machines were measured earlier, with one clean stripe.":
    [
      "1280×960 hat viermal so viele Pixel wie 640×480. Andere Maschinen: früher mit einem sauberen Streifen gemessen.",
      "1280×960 的像素数是 640×480 的四倍。其他机器为先前以单条干净激光线测得。",
      "1280×960 の画素数は 640×480 の4倍です。他の機械は以前、きれいな一本線で測定しました。"
    ],
  "68 % within": ["68 % innerhalb", "68 % 在此范围内", "68 % がこの範囲内"],
  "A camera of": ["Eine Kamera mit", "相机", "カメラ"],
  "A station is its folder: settings, calibrations, recipes and jobs. Copy it while the program is ended.":
    [
      "Ein Ordner mit Einstellungen, Kalibrierungen, Rezepten, Aufträgen. Vor dem Kopieren das Programm beenden.",
      "工作站就是它的文件夹：设置、标定、配方和任务。请在程序结束后复制。",
      "ステーションはフォルダーそのものです：設定、校正、レシピ、ジョブ。プログラム終了中にコピーしてください。"
    ],
  "A sweep needs calibrations of camera, laser plane and hand-eye.": [
    "Eine Abtastfahrt braucht die Kalibrierungen von Kamera, Laserebene und Hand-Auge.",
    "扫掠需要相机、激光平面和手眼的标定。",
    "走査にはカメラ、レーザー平面、ハンドアイの校正が必要です。"
  ],
  "A term is not known: the sum is a lower bound.": [
    "Ein Beitrag ist nicht bekannt: Die Summe ist eine untere Grenze.",
    "有一项未知：总和为下限。",
    "不明な項があります：合計は下限です。"
  ],
  "Above the plane": ["Über der Ebene", "高于平面", "平面からの高さ"],
  "Accept into the station": ["In die Station übernehmen", "接受到工作站", "ステーションに採用"],
  "Across, mm": ["Quer, mm", "横向，mm", "横に, mm"],
  "Add": ["Hinzufügen", "添加", "追加"],
  "Age, days": ["Alter, Tage", "天数", "経過日数"],
  "All": ["Alles", "全部", "全体"],
  "All at once": ["Alles zusammen", "一次全部", "まとめて"],
  "All at once, by the robot": ["Alles, durch den Roboter", "由机器人一次完成", "ロボットで一括"],
  "Along": ["Entlang", "方向", "方向"],
  "Along the stripe": ["Entlang des Streifens", "沿激光线", "レーザー線に沿って"],
  "Along, mm": ["Entlang, mm", "沿向，mm", "沿って, mm"],
  "Alt and a digit open a page; Tab, arrows and Enter do the rest.": [
    "Alt und eine Ziffer öffnen eine Seite; Tab, Pfeile und Eingabe tun den Rest.",
    "Alt 加数字打开页面；其余用 Tab、方向键和回车。",
    "Alt と数字でページを開き、Tab・矢印・Enter で操作します。"
  ],
  "Approach": ["Anfahren", "接近", "アプローチ"],
  "Arm": ["Scharf schalten", "使能", "有効にする"],
  "Actual spacing at this speed": [
    "Tatsächlicher Bildabstand bei dieser Geschwindigkeit",
    "此速度下的实际间距",
    "この速度での実際の間隔"
  ],
  "Arm only while a person stands at the emergency stop.": [
    "Nur scharf schalten, während jemand am Not-Halt steht.",
    "仅当有人守在急停旁时才使能。",
    "非常停止のそばに人がいるときだけ有効にしてください。"
  ],
  "Axis": ["Achse", "轴", "軸"],
  "Back out": ["Zurückziehen", "退出", "後退する"],
  "Back up now": ["Jetzt sichern", "立即备份", "今すぐバックアップ"],
  "Backed up.": ["Gesichert.", "已备份。", "バックアップしました。"],
  "Backup": ["Sicherung", "备份", "バックアップ"],
  "Batch and repeats": ["Reihe und Wiederholungen", "批处理与重复", "一括と繰り返し"],
  "Tolerance": ["Toleranz", "公差", "許容差"],
  "Tolerance, degrees": ["Toleranz, Grad", "公差，度", "許容差、度"],
  "Benchmark": ["Leistung messen", "性能测试", "ベンチマーク"],
  "Board": ["Tafel", "标定板", "ボード"],
  "Both": ["Beides", "两者", "両方"],
  "Brightest level in each column": ["Hellster Wert jeder Spalte", "每列最亮值", "各列の最大輝度"],
  "Calibrate": ["Kalibrieren", "标定", "校正"],
  "Calibration": ["Kalibrierung", "标定", "校正"],
  "Calibrations": ["Kalibrierungen", "标定结果", "校正一覧"],
  "Camera": ["Kamera", "相机", "カメラ"],
  "Camera is mounted": ["Kamera sitzt", "相机安装在", "カメラの取り付け"],
  "Camera to board": ["Kamera zur Platine", "相机到电路板", "カメラから基板まで"],
  "Camera's pictures a second": ["Bilder je Sekunde der Kamera", "相机帧/秒", "カメラの枚/秒"],
  "Cell": ["Zelle", "网格", "セル"],
  "Check all": ["Alles prüfen", "全部检查", "すべて点検"],
  "Check and save": ["Prüfen und speichern", "检查并保存", "確認して保存"],
  "Checks": ["Prüfungen", "检查", "点検"],
  "Choose a recipe and press Find, or teach a new part on the map.": [
    "Rezept wählen und Suchen drücken, oder auf der Karte ein neues Teil anlernen.",
    "选择配方并按“查找”，或在图上示教新零件。",
    "レシピを選んで「検索」を押すか、マップ上で新しい部品を教示します。"
  ],
  "Choose a tool above the map, then drag or click.": [
    "Werkzeug über der Karte wählen, dann ziehen oder klicken.",
    "选择图上方的工具，然后拖动或点击。",
    "マップ上のツールを選び、ドラッグまたはクリックします。"
  ],
  "Close the gripper": ["Greifer schließen", "闭合夹爪", "グリッパーを閉じる"],
  "Colours": ["Farben", "颜色", "配色"],
  "Columns": ["Spalten", "列数", "列"],
  "Compare": ["Vergleichen", "比较", "比較"],
  "Component in the simulated gripper; the arm is jogged over its part": [
    "Bauteil im simulierten Greifer; der Arm wird über seinen Sockel gefahren",
    "模拟夹爪中的元件；机械臂移到其零件上方",
    "模擬グリッパーの部品。アームはその部品の上へ動かされます"
  ],
  "Construct": ["Konstruieren", "构造", "構成する"],
  "Constructed points": ["Konstruierte Punkte", "构造点", "構成点"],
  "Contrast": ["Kontrast", "对比度", "コントラスト"],
  "Measured on this machine with a camera of": [
    "Auf dieser Maschine gemessen, mit einer Kamera mit",
    "在本机实测，相机为",
    "この機械で測定、カメラは"
  ],
  "Counters": ["Zähler", "计数", "カウンター"],
  "Covered": ["Abgedeckt", "覆盖", "被覆"],
  "Cut off when the program ended": [
    "Beim Ende des Programms abgebrochen",
    "程序结束时中断",
    "プログラム終了時に中断"
  ],
  "Cut out": ["Ausschneiden", "剪除", "切り抜く"],
  "Delay": ["Verzögerung", "延迟", "遅延"],
  "Delete": ["Löschen", "删除", "削除"],
  "Disk": ["Platte", "磁盘", "ディスク"],
  "Distance": ["Abstand", "距离", "距離"],
  "Distance along the camera's axis, mm": [
    "Abstand entlang der Kameraachse, mm",
    "沿相机轴距离，mm",
    "カメラ軸方向の距離, mm"
  ],
  "Drag over one or two pieces of the curve: lines are fitted, step and angle measured.": [
    "Über ein oder zwei Stücke der Kurve ziehen: Geraden werden angepasst, Stufe und Winkel gemessen.",
    "在曲线的一段或两段上拖动：拟合直线并测量台阶和角度。",
    "曲線の一、二区間をドラッグすると直線を当てはめ、段差と角度を測ります。"
  ],
  "Draw a box around a window": ["Rahmen um ein Fenster ziehen", "框出窗口", "窓を囲む"],
  "Draw a box around the body": ["Rahmen um den Körper ziehen", "框出零件本体", "本体を囲む"],
  "Draw a box around the area to remove": [
    "Rahmen um den Bereich ziehen, der entfernt wird",
    "框出要移除的区域",
    "除去する範囲を枠で囲む"
  ],
  "Draw a box around the area to keep": [
    "Rahmen um den Bereich ziehen, der bleibt",
    "框出要保留的区域",
    "残す範囲を枠で囲む"
  ],
  "Draw a box over the plane": ["Rahmen über die Ebene ziehen", "框出平面", "平面を囲む"],
  "Each motion is shown here and waits for the held button.": [
    "Jede Bewegung wird hier gezeigt und wartet auf die gehaltene Taste.",
    "每个动作都在此显示，并等待按住按钮。",
    "各動作はここに表示され、ボタンの長押しを待ちます。"
  ],
  "Enlarge": ["Vergrößern", "放大", "拡大"],
  "Expected error": ["Erwarteter Fehler", "预期误差", "予想誤差"],
  "Expected error of a scanned point, stop by stop": [
    "Erwarteter Fehler eines gescannten Punktes, Halt für Halt",
    "每个停点后扫描点的预期误差",
    "停止ごとの走査点の予想誤差"
  ],
  "Expected error, mm": ["Erwarteter Fehler, mm", "预期误差，mm", "予想誤差、mm"],
  "Exposure": ["Belichtung", "曝光", "露光"],
  "Figure": ["Größe", "指标", "項目"],
  "Figures": ["Kennzahlen", "数据", "数値"],
  "Filters": ["Filter", "滤除", "フィルター"],
  "Find": ["Suchen", "查找", "検索"],
  "Find a part": ["Teil suchen", "查找零件", "部品を検索"],
  "Flange at the first and the last shot": [
    "Flansch beim ersten und beim letzten Bild",
    "首帧和末帧的法兰位姿",
    "最初と最後のショットのフランジ"
  ],
  "Flange goes to": ["Flansch geht nach", "法兰移至", "フランジの行き先"],
  "Folder": ["Ordner", "文件夹", "フォルダー"],
  "Folders": ["Ordner", "文件夹", "フォルダー"],
  "Found": ["Gefunden", "结果", "検出"],
  "Frame": ["Bild", "帧", "フレーム"],
  "Frames": ["Bilder", "帧数", "フレーム"],
  "From": ["Aus", "来源", "元"],
  "From a drawing (DXF)": ["Aus einer Zeichnung (DXF)", "从图纸（DXF）", "図面から（DXF）"],
  "From a hole's middle to its rim": [
    "Von der Mitte eines Lochs zum Rand",
    "从孔中心到边缘",
    "穴の中心から縁まで"
  ],
  "From shot to shot": ["Von Bild zu Bild", "帧间距", "ショット間隔"],
  "From the middle of the first hole of a grid to its rim": [
    "Von der Mitte des ersten Lochs eines Rasters zu seinem Rand",
    "从阵列第一个孔的中心到其边缘",
    "格子の最初の穴の中心から縁まで"
  ],
  "Gain": ["Verstärkung", "增益", "ゲイン"],
  "Gates": ["Bedingungen", "判定条件", "判定"],
  "Give the arm back": ["Arm zurückgeben", "交还机械臂", "アームを返す"],
  "Grid": ["Raster", "网格阵列", "格子"],
  "Halt when the pose stands still for": [
    "Anhalten, wenn die Pose stillsteht seit",
    "位姿静止达此时间则停止",
    "姿勢が止まったままなら停止するまで"
  ],
  "Hand-eye": ["Hand-Auge", "手眼", "ハンドアイ"],
  "Health": ["Zustand", "状态", "健全性"],
  "Height": ["Höhe", "高度", "高さ"],
  "Height map": ["Höhenkarte", "高度图", "高さマップ"],
  "Height map of the running scan": [
    "Höhenkarte des laufenden Scans",
    "当前扫描的高度图",
    "実行中スキャンの高さマップ"
  ],
  "Height map, line by line": [
    "Höhenkarte, Zeile für Zeile",
    "逐行高度图",
    "高さマップ（一行ずつ）"
  ],
  "Heights": ["Höhen", "高度", "高さ"],
  "Histogram": ["Histogramm", "直方图", "ヒストグラム"],
  "Histogram (logarithmic)": [
    "Histogramm (logarithmisch)",
    "直方图（对数）",
    "ヒストグラム（対数）"
  ],
  "Histogram of repeats": ["Histogramm der Wiederholungen", "重复直方图", "繰り返しのヒストグラム"],
  "Hold the board next": [
    "Die Tafel als Nächstes halten",
    "下一次放置标定板",
    "次にボードを置く位置"
  ],
  "Hold to move": ["Halten zum Bewegen", "按住以移动", "押し続けて動かす"],
  "Hole": ["Loch", "孔", "穴"],
  "How the boards leaned, 15, 30, 45 degrees": [
    "Wie die Tafeln geneigt waren, 15, 30, 45 Grad",
    "标定板倾斜方向，15、30、45 度",
    "ボードの傾き、15・30・45 度"
  ],
  "How the stripe is found": ["Wie der Streifen gefunden wird", "条纹提取设置", "ラインの検出設定"],
  "I have looked": ["Ich habe nachgesehen", "我已查看", "確認しました"],
  "Deviation from the median, in the scan's frame. It is valid only if the part did not move between recordings.":
    [
      "Abweichung vom Median, im Koordinatensystem des Scans. Gilt nur, wenn das Teil zwischen Aufnahmen stillstand.",
      "相对中位数的偏差，在扫描坐标系中。仅当零件在各次录制之间未移动时有效。",
      "走査の座標系での中央値からの偏差。記録の間に部品が動いていない場合にのみ有効です。"
    ],
  "Insert a part": ["Teil einsetzen", "插入零件", "部品を挿入"],
  "Insertion": ["Einsetzen", "插入", "挿入"],
  "Intensity": ["Helligkeit", "强度", "輝度"],
  "Islands": ["Inseln", "孤立块", "孤立片"],
  "The arm makes the shown motion once, while the button is held. Releasing the button halts it.": [
    "Der Arm führt die gezeigte Bewegung einmal aus, solange die Taste gehalten wird. Loslassen hält ihn an.",
    "按住按钮时，机械臂执行一次所示动作。松开按钮即停。",
    "ボタンを押している間、アームは表示された動作を一度だけ行います。離すと止まります。"
  ],
  "Job": ["Auftrag", "任务", "ジョブ"],
  "Jobs": ["Aufträge", "任务", "ジョブ"],
  "Jog over the board": ["Über die Tafel fahren", "移到标定板上方", "ボードの上へ動かす"],
  "Keep": ["Behalten", "保留", "残す"],
  "LIVE": ["LIVE", "实时", "ライブ"],
  "Lamp": ["Lampe", "灯", "照明"],
  "Language": ["Sprache", "语言", "言語"],
  "Largest tilt": ["Größte Neigung", "最大倾角", "最大傾き"],
  "Largest turn": ["Größte Drehung", "最大转角", "最大回転"],
  "Laser": ["Laser", "激光", "レーザー"],
  "Laser plane": ["Laserebene", "激光平面", "レーザー平面"],
  "Lasers and lamp for a second and a half; look away from the lasers. Nothing moves but the gripper.":
    [
      "Laser und Lampe für anderthalb Sekunden; nicht in die Laser sehen. Nichts bewegt sich außer dem Greifer.",
      "激光和灯亮一秒半；请勿直视激光。除夹爪外无任何运动。",
      "レーザーと照明は 1.5 秒間。レーザーを見ないこと。グリッパー以外は動きません。"
    ],
  "Lattice": ["Gitter", "点阵", "格子点"],
  "Layer": ["Schicht", "图层", "レイヤー"],
  "Leaned": ["Geneigt", "倾斜", "傾き"],
  "Exclude": ["Ausschließen", "排除", "除外"],
  "Length": ["Länge", "长度", "長さ"],
  "Levels": ["Grauwerte", "灰度", "輝度値"],
  "Likely cause": ["Wahrscheinliche Ursache", "可能原因", "考えられる原因"],
  "Limit": ["Grenze", "限制", "制限"],
  "Line": ["Linie", "直线", "直線"],
  "Line laser": ["Linienlaser", "线激光", "ラインレーザー"],
  "Longest motion": ["Längste Bewegung", "最长运动", "最長動作"],
  "Look at the robot.": [
    "Sehen Sie nach dem Roboter.",
    "请查看机器人。",
    "ロボットを確認してください。"
  ],
  "Look at the surface": ["Oberfläche ansehen", "查看表面", "表面を見る"],
  "Everybody may watch and stop. One person at a time may operate.": [
    "Zusehen und anhalten darf jeder. Bedienen darf immer nur einer.",
    "任何人都可观看和停止。每次只能一人操作。",
    "閲覧と停止は誰でもできます。操作は一人ずつです。"
  ],
  "Number of turns that look alike": [
    "Zahl der Drehlagen, die gleich aussehen",
    "看起来相同的旋转位置数",
    "同じに見える回転位置の数"
  ],
  "Make the recipe": ["Rezept erstellen", "生成配方", "レシピを作成"],
  "Map": ["Karte", "地图", "マップ"],
  "Permission": ["Berechtigung", "权限", "権限"],
  "Measure": ["Messen", "测量", "測定"],
  "Measured": ["Gemessen", "测量结果", "測定結果"],
  "Midpoint": ["Mitte", "中点", "中点"],
  "More settings": ["Weitere Einstellungen", "更多设置", "その他の設定"],
  "Motion": ["Bewegung", "动作", "動作"],
  "Motions": ["Bewegungen", "运动", "動作"],
  "Move": ["Bewegen", "移动", "移動"],
  "Move the map": ["Karte bewegen", "移动地图", "マップを移動"],
  "Name": ["Name", "名称", "名前"],
  "New": ["Neu", "新", "新"],
  "Next": ["Nächster Schritt", "下一步", "次の手順"],
  "Next picture": ["Nächstes Bild", "下一张图", "次の画像"],
  "No": ["Nein", "否", "いいえ"],
  "No motion limits are set: nothing moves. Set them in the table [motion] of station.toml below.":
    [
      "Ohne Bewegungsgrenzen bewegt sich nichts. Sie stehen in der Tabelle [motion] von station.toml unten.",
      "未设置运动限值：不会移动。限值是下方 station.toml 中的 [motion] 表。",
      "動作制限が未設定なので何も動きません。下の station.toml の [motion] 表で設定します。"
    ],
  "Limited by": ["Begrenzt durch", "受限于", "制限の要因"],
  "No motion waits for a confirmation.": [
    "Keine Bewegung wartet auf eine Bestätigung.",
    "没有等待确认的动作。",
    "確認待ちの動作はありません。"
  ],
  "No part was looked for yet.": [
    "Noch wurde kein Teil gesucht.",
    "尚未查找零件。",
    "まだ部品を検索していません。"
  ],
  "No pose: a gate was missed.": [
    "Keine Pose: Eine Bedingung ist verfehlt.",
    "无位姿：有判定未通过。",
    "姿勢なし：判定を満たしていません。"
  ],
  "No robot was named when the program was started.": [
    "Beim Start wurde kein Roboter genannt.",
    "启动时未指定机器人。",
    "起動時にロボットが指定されていません。"
  ],
  "No stop with board and count yet.": [
    "Noch kein Halt mit Tafel und Zählerstand.",
    "尚无带标定板和计数的停点。",
    "ボードとカウントのある停止点はまだありません。"
  ],
  "No stripe is seen in this picture.": [
    "In diesem Bild ist kein Streifen zu sehen.",
    "此图像中看不到激光线。",
    "この画像にはレーザー線が見えません。"
  ],
  "Nobody: the program was started without --allow-motion": [
    "Niemand: Das Programm wurde ohne --allow-motion gestartet",
    "无人：程序启动时未带 --allow-motion",
    "なし：--allow-motion なしで起動されました"
  ],
  "Not used": ["Nicht benutzt", "未使用", "未使用"],
  "Notation": ["Schreibweise", "表示法", "表記"],
  "Notation and limits": ["Schreibweise und Grenzen", "表示法和限值", "表記と制限"],
  "Notes": ["Hinweise", "说明", "注記"],
  "No known limit is reached.": [
    "Keine bekannte Grenze ist erreicht.",
    "未达到任何已知的限制。",
    "既知の制限には達していません。"
  ],
  "Nothing was checked yet.": ["Noch nichts geprüft.", "尚未检查。", "まだ点検していません。"],
  "Nothing was measured along this line.": [
    "Entlang dieser Linie wurde nichts gemessen.",
    "此线上没有测量值。",
    "この線上に測定値がありません。"
  ],
  "Nothing was scanned yet.": ["Noch nichts gescannt.", "尚未扫描。", "まだスキャンしていません。"],
  "No access: the screen serves only this machine": [
    "Kein Zugriff: Der Bildschirm ist nur für diese Maschine",
    "无访问权限：界面仅供本机",
    "アクセス不可：画面はこの機械のみ"
  ],
  "Now the point": ["Nun der Punkt", "现在选点", "次に点を選択"],
  "Of": ["Von", "取自", "元"],
  "Offset": ["Versatz", "偏移", "オフセット"],
  "Old against new": ["Alt gegen neu", "新旧对比", "新旧比較"],
  "On": ["Auf", "运行于", "実行先"],
  "Point at two pins: their midpoint sets the tool's position": [
    "Auf zwei Stifte zeigen: Ihre Mitte bestimmt die Position des Werkzeugs",
    "依次指向两个针脚：其中点决定工具位置",
    "ピンを 2 本指すと、その中点が工具の位置になります"
  ],
  "Only watch": ["Nur zusehen", "仅观看", "閲覧のみ"],
  "Open": ["Öffnen", "打开", "開く"],
  "Open the address that it printed.": [
    "Öffnen Sie die Adresse, die es ausgegeben hat.",
    "请打开它显示的地址。",
    "表示されたアドレスを開いてください。"
  ],
  "Open the gripper": ["Greifer öffnen", "张开夹爪", "グリッパーを開く"],
  "Operate": ["Bedienen", "操作", "操作する"],
  "Other machines": ["Andere Maschinen", "其他机器", "他の機械"],
  "Other settings for the next run": [
    "Andere Einstellungen für den nächsten Lauf",
    "下次运行的其他设置",
    "次回の設定変更"
  ],
  "Outline": ["Umriss", "轮廓", "外形"],
  "The outlines show where this camera should see the part. If they lie beside it, do not move the arm.":
    [
      "Die Umrisse zeigen, wo diese Kamera das Teil sehen müsste. Liegen sie daneben: den Arm nicht bewegen.",
      "轮廓表示此相机应看到零件的位置。若轮廓偏离零件，请勿移动机械臂。",
      "輪郭は、部品がこのカメラに見えるはずの位置を示します。部品からずれている場合はアームを動かさないでください。"
    ],
  "Output of the gripper": ["Ausgang des Greifers", "夹爪输出", "グリッパーの出力"],
  "Output of the lamp": ["Ausgang der Lampe", "灯的输出", "照明の出力"],
  "Output of the line laser": ["Ausgang des Linienlasers", "线激光输出", "ラインレーザーの出力"],
  "Output of the pointer": ["Ausgang des Zeigers", "指针输出", "ポインターの出力"],
  "Over the board that was touched.": [
    "Über der Platine, die angetastet wurde.",
    "在已触测的电路板上方。",
    "触れた基板の上。"
  ],
  "Part": ["Teil", "零件", "部品"],
  "Password": ["Passwort", "密码", "パスワード"],
  "Path over the part": ["Weg über das Teil", "零件上的扫描路径", "部品上の経路"],
  "Peak": ["Spitze", "峰值", "ピーク"],
  "Picture": ["Bild", "图像", "画像"],
  "Pictures": ["Bilder", "图像", "画像"],
  "Pictures a second": ["Bilder je Sekunde", "每秒图像数", "毎秒の画像数"],
  "Pictures, with the corners that were found": [
    "Bilder mit den gefundenen Ecken",
    "图像及找到的角点",
    "画像と見つかった角"
  ],
  "Piece": ["Stück", "区段", "区間"],
  "Pitch across, mm": ["Abstand quer, mm", "行距，mm", "行ピッチ, mm"],
  "Pitch along, mm": ["Abstand entlang, mm", "列距，mm", "列ピッチ, mm"],
  "Places of the picture that boards covered": [
    "Stellen des Bilds, die Tafeln abdeckten",
    "标定板覆盖的图像区域",
    "ボードが覆った画像の場所"
  ],
  "Point": ["Punkt", "点", "点"],
  "Point to plane": ["Punkt zu Ebene", "点到平面", "点と平面"],
  "Pointer": ["Zeiger", "激光指针", "ポインター"],
  "Points in three dimensions; arrows turn, + and − enlarge": [
    "Punkte im Raum; Pfeile drehen, + und − vergrößern",
    "三维点云；方向键旋转，+ − 缩放",
    "三次元点群；矢印で回転、+ − で拡大縮小"
  ],
  "Pose": ["Pose", "位姿", "姿勢"],
  "Poses are written as": ["Posen werden geschrieben als", "位姿表示法", "姿勢の表記"],
  "Position": ["Position", "位置", "位置"],
  "Press a picture to exclude it, then calibrate again.": [
    "Bild drücken, um es auszuschließen, dann neu kalibrieren.",
    "点击图像将其排除，然后重新标定。",
    "画像を押して除外し、再校正します。"
  ],
  "Progress": ["Fortschritt", "进度", "進捗"],
  "Compute the perpendicular pose": [
    "Pose senkrecht zur Fläche berechnen",
    "计算垂直位姿",
    "面に垂直な姿勢を計算"
  ],
  "Put the board's description into the station's folder boards.": [
    "Legen Sie die Beschreibung der Tafel in den Ordner boards der Station.",
    "请把标定板的描述放入工作站的 boards 文件夹。",
    "ボードの記述をステーションの boards フォルダーに置いてください。"
  ],
  "REPLAY": ["WIEDERGABE", "回放", "再生"],
  "Really replace it?": ["Wirklich ersetzen?", "确定替换？", "本当に置き換えますか？"],
  "Really restore?": ["Wirklich wiederherstellen?", "确定恢复？", "本当に復元しますか？"],
  "Recipe": ["Rezept", "配方", "レシピ"],
  "Recipe as text": ["Rezept als Text", "配方文本", "レシピ本文"],
  "Estimated from the time per shot, for a camera of": [
    "Aus der Zeit je Bild geschätzt, für eine Kamera mit",
    "按每帧用时推算，相机为",
    "1ショットの時間から推定、カメラは"
  ],
  "Recording": ["Aufnahme", "录制", "記録"],
  "Recording of the pointer": ["Aufnahme des Zeigers", "指针录制", "ポインターの記録"],
  "Recordings": ["Aufnahmen", "录制", "記録"],
  "Recordings that are solved together.": [
    "Aufnahmen, die zusammen gelöst werden.",
    "一起求解的录制。",
    "まとめて解く記録。"
  ],
  "Reduce": ["Verkleinern", "缩小", "縮小"],
  "Region": ["Bereich", "区域", "領域"],
  "Repeat": ["Wiederholen", "重复", "繰り返す"],
  "Replay": ["Wiedergabe", "回放", "再生"],
  "Restore": ["Wiederherstellen", "恢复", "復元"],
  "Restored; the previous state is a backup too.": [
    "Wiederhergestellt; der vorige Stand ist auch gesichert.",
    "已恢复；之前的状态也已备份。",
    "復元しました。前の状態もバックアップ済みです。"
  ],
  "Result": ["Ergebnis", "结果", "結果"],
  "Resume": ["Fortsetzen", "继续", "再開"],
  "Resume measures again if the tool has not set out for the part. Otherwise the tool moves back up.":
    [
      "Fortsetzen misst neu, wenn das Werkzeug noch nicht zum Teil aufgebrochen ist. Sonst fährt es zurück nach oben.",
      "继续：如果工具尚未向零件移动，则重新测量；否则工具退回上方。",
      "再開：工具がまだ部品へ向かっていなければ、測り直します。そうでなければ工具は上へ戻ります。"
    ],
  "Resume or delete": ["Fortsetzen oder löschen", "继续或删除", "再開または削除"],
  "Retract": ["Zurückziehen", "退回", "退避"],
  "Robot": ["Roboter", "机器人", "ロボット"],
  "Rows": ["Reihen", "行数", "行"],
  "Run batch": ["Reihe laufen lassen", "运行批处理", "一括実行"],
  "SIMULATED": ["SIMULIERT", "仿真", "シミュレーション"],
  "Save": ["Speichern", "保存", "保存"],
  "Save as": ["Speichern als", "另存为", "名前を付けて保存"],
  "Save as a scan": ["Als Scan speichern", "另存为扫描", "スキャンとして保存"],
  "Saved.": ["Gespeichert.", "已保存。", "保存しました。"],
  "Scan": ["Scan", "扫描", "スキャン"],
  "Scan B again": ["B erneut scannen", "重新扫描 B", "B を再スキャン"],
  "Scans and poses are in the frame": [
    "Scans und Lagen im Koordinatensystem",
    "扫描与位姿所在坐标系",
    "スキャンと姿勢の座標系"
  ],
  "Section": ["Schnitt", "截面", "断面"],
  "Section: from, to": ["Schnitt: von, bis", "截面：起点、终点", "断面：始点、終点"],
  "Set exposure": ["Belichtung einstellen", "设置曝光", "露光を設定"],
  "Setting": ["Einstellung", "设置", "設定"],
  "Settings": ["Einstellungen", "设置", "設定"],
  "Settings, calibrations, recipes and boards in one file, without jobs. One is made before each change.":
    [
      "Einstellungen, Kalibrierungen, Rezepte und Tafeln, ohne Aufträge. Vor jeder Änderung entsteht eine Datei.",
      "设置、标定、配方和标定板存于一个文件，不含任务。每次更改前自动备份。",
      "設定・校正・レシピ・ボードを一つのファイルに（ジョブは含まない）。変更の前に毎回作られます。"
    ],
  "A construction needs named shapes. A lattice needs a grid. An offset needs a line or a lattice.":
    [
      "Konstruktionen brauchen benannte Formen. Ein Gitter braucht ein Raster. Ein Versatz braucht Linie oder Gitter.",
      "构造需要已命名的形状。点阵需要网格。偏移需要直线或点阵。",
      "構成には名前の付いた形状が必要です。格子点には格子が必要です。オフセットには直線か格子点が必要です。"
    ],
  "Source": ["Quelle", "来源", "要因"],
  "Speed": ["Geschwindigkeit", "速度", "速度"],
  "Speed and step of a continuous scan": [
    "Geschwindigkeit und Schritt eines kontinuierlichen Scans",
    "连续扫描的速度与步距",
    "連続走査の速度とステップ"
  ],
  "Speed of motions": ["Tempo der Bewegungen", "运动速度", "動作速度"],
  "Spots": ["Punkte", "光点", "スポット"],
  "Perpendicular pose": ["Pose senkrecht zur Fläche", "垂直位姿", "面に垂直な姿勢"],
  "Standard deviation": ["Standardabweichung", "标准差", "標準偏差"],
  "Start": ["Start", "开始", "開始"],
  "State": ["Zustand", "状态", "状態"],
  "Station": ["Station", "工作站", "ステーション"],
  "Step": ["Stufe", "台阶", "段差"],
  "Stop": ["Anhalten", "停止", "停止"],
  "Stop next at": ["Nächster Halt bei", "下一停点", "次の停止点"],
  "Stops along the axis": ["Halte entlang der Achse", "沿轴的停点", "軸に沿った停止点"],
  "Stops of the axis": ["Halte der Achse", "轴的停点", "軸の停止点"],
  "Support file": ["Datei für den Support", "支持文件", "サポートファイル"],
  "Support file (no pictures)": [
    "Datei für den Support (ohne Bilder)",
    "支持文件（不含图像）",
    "サポートファイル（画像なし）"
  ],
  "Surface": ["Oberfläche", "表面", "表面"],
  "Sweep": ["Abtastfahrt", "扫掠", "走査"],
  "Sweep, mm": ["Strecke, mm", "扫描行程，mm", "走査幅、mm"],
  "Download": ["Herunterladen", "下载", "ダウンロード"],
  "Remove": ["Entfernen", "移除", "除去"],
  "Take over from": ["Übernehmen von", "接管自", "引き継ぐ："],
  "Target": ["Ziel", "对象", "対象"],
  "Teach": ["Anlernen", "示教", "教示"],
  "Test output": ["Ausgang prüfen", "测试输出", "出力テスト"],
  "The arm moves: the part is drawn where it was a moment ago.": [
    "Der Arm bewegt sich: Das Teil ist gezeichnet, wo es eben noch war.",
    "机械臂在移动：零件画在片刻之前的位置。",
    "アーム動作中：部品は少し前の位置に描かれています。"
  ],
  "The benchmark measures the whole chain, every pixel, on this machine's processor and its GPU.": [
    "Gemessen wird die ganze Kette, jedes Pixel, auf Prozessor und GPU dieser Maschine.",
    "测试完整处理链（逐像素），在本机处理器和 GPU 上。",
    "この機械の CPU と GPU で全画素の処理全体を測ります。"
  ],
  "The board is taken to lie squarely before the camera until it is touched.": [
    "Bis sie angetastet ist, gilt die Platine als gerade vor der Kamera.",
    "触测之前，假定电路板正对相机。",
    "触れるまでは、基板がカメラに正対しているとみなします。"
  ],
  "The camera's newest picture": [
    "Das neueste Bild der Kamera",
    "相机的最新图像",
    "カメラの最新画像"
  ],
  "The drawing is larger than 1 MB: use sheetlight model on the command line.": [
    "Die Zeichnung ist größer als 1 MB: sheetlight model in der Befehlszeile benutzen.",
    "图纸大于 1 MB：请在命令行使用 sheetlight model。",
    "図面が 1 MB を超えています：コマンドラインの sheetlight model を使ってください。"
  ],
  "The fastest way:": ["Der schnellste Weg:", "最快方式：", "最速："],
  "The first small moves give no estimate yet.": [
    "Die ersten kleinen Bewegungen ergeben noch keine Schätzung.",
    "最初的小动作尚不能给出估计。",
    "最初の小さな動きではまだ推定できません。"
  ],
  "The job works; no motion waits.": [
    "Der Auftrag arbeitet; keine Bewegung wartet.",
    "任务进行中；没有等待的动作。",
    "ジョブ実行中。待っている動作はありません。"
  ],
  "The part as it was found": ["Das Teil, wie es gefunden wurde", "找到的零件", "見つかった部品"],
  "The part, enlarged": ["Das Teil, vergrößert", "零件，放大", "部品の拡大"],
  "The pointer's spot on three or more places gives the plane to which the tool becomes perpendicular.":
    [
      "Der Zeigerpunkt an drei oder mehr Stellen gibt die Ebene, zu der das Werkzeug senkrecht wird.",
      "三处或更多处的指针光点给出工具将与之垂直的平面。",
      "三か所以上のスポットから、工具が垂直になる平面が求まります。"
    ],
  "The program does not answer.": [
    "Das Programm antwortet nicht.",
    "程序无响应。",
    "プログラムが応答しません。"
  ],
  "The program was started again.": [
    "Das Programm wurde neu gestartet.",
    "程序已重新启动。",
    "プログラムが再起動されました。"
  ],
  "The program was started without --allow-motion, so the robot does not move.": [
    "Das Programm wurde ohne --allow-motion gestartet, daher bewegt sich der Roboter nicht.",
    "程序启动时未带 --allow-motion，因此机器人不会移动。",
    "プログラムは --allow-motion なしで起動されたため、ロボットは動きません。"
  ],
  "The same, with the password, over TLS": [
    "Dasselbe, mit Passwort, über TLS",
    "同上，需密码并经 TLS",
    "同じ。パスワードと TLS で"
  ],
  "The spots make no plane.": [
    "Die Punkte ergeben keine Ebene.",
    "光点不构成平面。",
    "スポットが平面になりません。"
  ],
  "The station has no [tool]: tilt and perpendicular pose are unknown. Add it on the page Settings.":
    [
      "Die Station hat kein [tool]: Neigung und senkrechte Pose sind unbekannt. Auf der Seite Einstellungen ergänzen.",
      "工作站没有 [tool]：倾斜和垂直位姿未知。请在“设置”页添加。",
      "ステーションに [tool] がありません：傾きと垂直な姿勢は不明です。「設定」で追加してください。"
    ],
  "The tool is perpendicular to the surface within 3 sigma.": [
    "Das Werkzeug steht innerhalb von 3 Sigma senkrecht zur Fläche.",
    "工具在 3 sigma 内与表面垂直。",
    "工具は 3 シグマ以内で面に垂直です。"
  ],
  "This motion only turns the tool about its tip. This page moves nothing.": [
    "Diese Bewegung dreht das Werkzeug nur um seine Spitze. Diese Seite bewegt nichts.",
    "此动作只使工具绕其尖端转动。本页面不会产生运动。",
    "この動作は工具を先端まわりに回すだけです。このページからは何も動きません。"
  ],
  "The two scans have no place in common.": [
    "Die beiden Scans haben keine Stelle gemeinsam.",
    "两次扫描没有共同区域。",
    "二つのスキャンに共通部分がありません。"
  ],
  "The whole report": ["Der ganze Bericht", "完整报告", "全報告"],
  "Tolerance of the work": ["Toleranz der Arbeit", "工作公差", "作業の許容差"],
  "There is no recording of a board for this.": [
    "Dafür gibt es keine Aufnahme einer Tafel.",
    "没有适用的标定板录制。",
    "これに使えるボードの記録がありません。"
  ],
  "The folder of recordings contains no recording of the laser line.": [
    "Der Ordner der Aufnahmen enthält keine Aufnahme der Laserlinie.",
    "录制文件夹中没有激光线的录制。",
    "記録フォルダーにレーザー線の記録がありません。"
  ],
  "There is no recording of the pointer on a surface.": [
    "Es gibt keine Aufnahme des Zeigers auf einer Fläche.",
    "没有指针在表面上的录制。",
    "面上のポインター記録がありません。"
  ],
  "There is no recording.": ["Es gibt keine Aufnahme.", "没有录制。", "記録がありません。"],
  "This browser has no WebGL2: the map shows the same points.": [
    "Dieser Browser hat kein WebGL2: Die Karte zeigt dieselben Punkte.",
    "此浏览器不支持 WebGL2：地图显示相同的点。",
    "WebGL2 がありません：マップで同じ点を表示します。"
  ],
  "This camera has nothing that can be set from here.": [
    "An dieser Kamera lässt sich von hier nichts einstellen.",
    "此相机没有可在此设置的项目。",
    "このカメラにはここから設定できるものがありません。"
  ],
  "This machine": ["Diese Maschine", "本机", "この機械"],
  "This machine, with the address of this start": [
    "Diese Maschine, mit der Adresse dieses Starts",
    "本机，使用本次启动的地址",
    "この機械、今回の起動アドレスで"
  ],
  "This screen": ["Dieser Bildschirm", "此屏幕", "この画面"],
  "This station is not calibrated yet.": [
    "Diese Station ist noch nicht kalibriert.",
    "该工作站尚未标定。",
    "このステーションは未校正です。"
  ],
  "Time of the last scan": ["Zeit des letzten Scans", "上次扫描用时", "前回スキャンの時間"],
  "Tool": ["Werkzeug", "工具", "工具"],
  "Tool goes to": ["Werkzeug geht nach", "工具移至", "工具の行き先"],
  "Tool goes to the part's own place": [
    "Werkzeug geht an den Ort des Teils selbst",
    "工具移至零件自身位置",
    "工具は部品自身の位置へ"
  ],
  "Tool is at": ["Werkzeug ist bei", "工具位于", "工具の位置"],
  "Tools": ["Werkzeuge", "工具", "ツール"],
  "Touch": ["Antasten", "触测", "タッチ"],
  "Turn": ["Drehung", "转角", "回転"],
  "Turning rate at most": ["Drehrate höchstens", "最大转速", "最大回転速度"],
  "Two or more places of one recipe show how well they repeat.": [
    "Zwei oder mehr Orte eines Rezepts zeigen, wie gut sie sich wiederholen.",
    "同一配方的两个以上位置可显示重复性。",
    "同じレシピの位置が二つ以上で再現性が分かります。"
  ],
  "Two pins": ["Zwei Stifte", "两个针脚", "2 本のピン"],
  "Two points": ["Zwei Punkte", "两点", "二点間"],
  "Uncertain": ["Unsichere", "不确定处", "不確かな箇所"],
  "Undo": ["Rückgängig", "撤销", "元に戻す"],
  "Unit, where it names none": [
    "Einheit, wenn sie keine nennt",
    "单位（图纸未注明时）",
    "単位（図面にない場合）"
  ],
  "Value": ["Wert", "值", "値"],
  "Verdict": ["Urteil", "结论", "判定"],
  "What": ["Was", "项目", "対象"],
  "The part will drop. Open the gripper?": [
    "Das Teil fällt herunter. Greifer öffnen?",
    "零件会掉落。打开夹爪？",
    "部品が落ちます。グリッパーを開きますか？"
  ],
  "What it is": ["Was es ist", "说明", "内容"],
  "The limit of the speed is unknown. State the camera's pictures per second, or scan once.": [
    "Die Grenze der Geschwindigkeit ist unbekannt. Bilder je Sekunde der Kamera angeben oder einmal scannen.",
    "速度限制未知。请填写相机帧率，或先扫描一次。",
    "速度の制限が不明です。カメラの枚/秒を入れるか、一度走査してください。"
  ],
  "What the boards cover": ["Was die Tafeln abdecken", "标定板覆盖范围", "ボードの覆う範囲"],
  "What was found": ["Was gefunden wurde", "找到的结果", "見つかったもの"],
  "Where in the picture the stripe is looked for": [
    "Wo im Bild der Streifen gesucht wird",
    "在图像的何处寻找激光线",
    "画像のどこでレーザー線を探すか"
  ],
  "Where it comes from": ["Woher sie kommt", "来源分解", "内訳"],
  "Who": ["Wer", "谁", "誰"],
  "Who armed the robot and holds the button": [
    "Wer den Roboter scharf geschaltet hat und die Taste hält",
    "使能机器人并按住按钮的人",
    "ロボットを有効にしボタンを押している人"
  ],
  "Who may what": ["Wer was darf", "权限", "権限"],
  "Whole picture": ["Ganzes Bild", "整幅图像", "画像全体"],
  "Width": ["Breite", "宽度", "幅"],
  "Window": ["Fenster", "窗口", "窓"],
  "Working volume from": ["Arbeitsraum von", "工作范围起", "作業範囲の下限"],
  "Working volume to": ["Arbeitsraum bis", "工作范围止", "作業範囲の上限"],
  "Working volume, camera depth": [
    "Arbeitsraum, Kameratiefe",
    "工作范围（相机深度）",
    "作業範囲（カメラ奥行き）"
  ],
  "You operate": ["Sie bedienen", "您在操作", "操作中"],
  "a shot": ["je Bild", "每帧", "1ショット"],
  "absent": ["fehlt", "缺失", "なし"],
  "accepted": ["übernommen", "已接受", "採用済み"],
  "after": ["nach", "经过", "後"],
  "and": ["und", "和", "と"],
  "angle": ["Winkel", "角度", "角度"],
  "apart at most": ["höchstens auseinander", "最大间距", "最大の差"],
  "approach": ["anfahren", "接近", "接近"],
  "armed": ["scharf", "已使能", "有効"],
  "as it says": ["wie angegeben", "按图纸", "図面どおり"],
  "as the system": ["wie das System", "跟随系统", "システムに従う"],
  "auto": ["automatisch", "自动", "自動"],
  "axes of the part": ["Achsen des Teils", "零件坐标轴", "部品の軸"],
  "axis": ["Achse", "轴", "軸"],
  "back out?": ["Zurückziehen?", "退出？", "後退しますか？"],
  "bad": ["schlecht", "不合格", "不良"],
  "badly determined": ["schlecht bestimmt", "确定性差", "不確か"],
  "base": ["Basis", "基座", "ベース"],
  "base camera": ["feststehende Kamera", "固定相机", "固定カメラ"],
  "allows, mm/s": ["erlaubt, mm/s", "可承受，mm/s", "許容 mm/s"],
  "beside the robot, it stands still": [
    "neben dem Roboter, sie steht still",
    "机器人旁，固定不动",
    "ロボットの横に固定"
  ],
  "bottom": ["unten", "下", "下"],
  "brightest of 255": ["hellster von 255", "最亮（255）", "最大（255中）"],
  "browsers look on": ["Browser sehen zu", "个浏览器在看", "ブラウザー接続"],
  "camera": ["Kamera", "相机", "カメラ"],
  "camera above the board": ["Kamera über der Platine", "相机距电路板高度", "基板からのカメラ高さ"],
  "cell": ["Zelle", "网格", "セル"],
  "cells": ["Zellen", "个网格", "セル"],
  "cells are left": ["Zellen bleiben", "个网格保留", "セルが残る"],
  "cells in both": ["Zellen in beiden", "共同网格", "共通セル"],
  "cells removed": ["Zellen entfernt", "个网格被移除", "セルを除去"],
  "columns without light": ["Spalten ohne Licht", "无光列", "光のない列"],
  "contrast": ["Kontrast", "对比度", "コントラスト"],
  "counts": ["Zählschritte", "计数", "カウント"],
  "cut off when the program ended": [
    "beim Ende des Programms abgebrochen",
    "程序结束时中断",
    "プログラム終了時に中断"
  ],
  "cut_off": ["abgebrochen", "中断", "中断"],
  "dark": ["dunkel", "深色", "暗い"],
  "dark share": ["dunkler Anteil", "暗区占比", "暗い割合"],
  "disk left": ["Platte frei", "剩余磁盘", "ディスク残量"],
  "does not lie on the plane of the others and was excluded": [
    "liegt nicht auf der Ebene der anderen und wurde ausgeschlossen",
    "不在其他点的平面上，已排除",
    "他の平面上になく除外"
  ],
  "done": ["fertig", "完成", "完了"],
  "dropped": ["verworfen", "丢弃", "破棄"],
  "echo": ["Echo", "回波", "エコー"],
  "failed": ["fehlgeschlagen", "失败", "失敗"],
  "faint": ["schwach", "微弱", "弱い"],
  "fewer cells than": ["weniger Zellen als", "网格少于", "セル数未満"],
  "files": ["Dateien", "个文件", "ファイル"],
  "filtered": ["gefiltert", "已滤除", "フィルター済み"],
  "first": ["erstes", "首帧", "最初"],
  "first profile": ["erstes Profil", "首条轮廓", "最初のプロファイル"],
  "fixed to": ["fest an", "固定于", "固定先："],
  "flange": ["Flansch", "法兰", "フランジ"],
  "distance of the flange from the workspace limits": [
    "Abstand des Flansches vom Rand des Arbeitsraums",
    "法兰到工作空间边界的距离",
    "フランジから作業空間の境界までの距離"
  ],
  "flange, at the end": ["Flansch, am Ende", "法兰终点", "フランジの終点"],
  "found": ["gefunden", "已找到", "検出"],
  "frames in": ["Bilder herein", "输入帧", "入力フレーム"],
  "from": ["von", "从", "下限"],
  "from shot to shot": ["von Bild zu Bild", "帧间距", "ショット間隔"],
  "gates passed": ["Bedingungen erfüllt", "项判定条件满足", "個の判定に合格"],
  "go there?": ["Dorthin fahren?", "去那里？", "そこへ行きますか？"],
  "good": ["gut", "良好", "良好"],
  "hand-eye": ["Hand-Auge", "手眼", "ハンドアイ"],
  "height map and pictures": ["Höhenkarte und Bilder", "高度图和图像", "高さマップと画像"],
  "linked, not armed": ["verbunden, nicht scharf", "已连接，未使能", "接続済み、無効"],
  "longest gap between messages of the held button, limit 1 s": [
    "längste Pause zwischen Meldungen der gehaltenen Taste, Grenze 1 s",
    "按住按钮时消息的最长间隔，限 1 s",
    "押下中ボタンのメッセージの最長間隔、上限 1 s"
  ],
  "here": ["hier", "本机", "この機械"],
  "holes": ["Löcher", "个孔", "穴"],
  "in / measured / dropped": [
    "herein / gemessen / verworfen",
    "输入 / 测得 / 丢弃",
    "入力 / 測定 / 破棄"
  ],
  "in all": ["insgesamt", "总计", "合計"],
  "in the dashed box": ["in den gestrichelten Kasten", "在虚线框内", "破線の枠内"],
  "insert": ["einsetzen", "插入", "挿入"],
  "insert?": ["Einsetzen?", "插入？", "挿入しますか？"],
  "inserted": ["eingesetzt", "已插入", "挿入済み"],
  "is the component in? retract?": [
    "Sitzt das Bauteil? Zurückziehen?",
    "元件已插好？退回？",
    "部品は入りましたか？後退しますか？"
  ],
  "is the part where the picture shows it? go above it?": [
    "Ist das Teil, wo das Bild es zeigt? Darüber fahren?",
    "零件在图示位置吗？移到其上方？",
    "部品は図の位置にありますか？その上へ行きますか？"
  ],
  "is the path free?": ["Ist die Bahn frei?", "扫描路径是否畅通？", "走査経路は空いていますか？"],
  "is the way free?": ["Ist der Weg frei?", "路径是否畅通？", "経路は空いていますか？"],
  "its front turned down": ["Vorderseite nach unten gedreht", "正面转向下", "表面を下へ"],
  "its front turned to the left": ["Vorderseite nach links gedreht", "正面转向左", "表面を左へ"],
  "its front turned to the right": ["Vorderseite nach rechts gedreht", "正面转向右", "表面を右へ"],
  "its front turned up": ["Vorderseite nach oben gedreht", "正面转向上", "表面を上へ"],
  "joint covariance": ["gemeinsame Kovarianz", "联合协方差", "結合共分散"],
  "keeps up with": ["schafft", "可跟上", "追従可能"],
  "kept": ["eingehalten", "通过", "合格"],
  "laser plane": ["Laserebene", "激光平面", "レーザー平面"],
  "last": ["letztes", "末帧", "最後"],
  "left": ["links", "左", "左"],
  "light": ["hell", "浅色", "明るい"],
  "linear axis": ["Linearachse", "直线轴", "直動軸"],
  "lost": ["verloren", "丢失", "消失"],
  "map: arrows move the cross, Enter puts a point": [
    "Karte: Pfeile bewegen das Kreuz, Eingabe setzt einen Punkt",
    "地图：方向键移动十字，回车放点",
    "マップ：矢印で十字を移動、Enter で点を置く"
  ],
  "mark: a third of the insertion's tolerance": [
    "Marke: ein Drittel dessen, was das Einsetzen verträgt",
    "标记：插入公差的三分之一",
    "印：挿入許容差の三分の一"
  ],
  "measured": ["gemessen", "测得", "測定済み"],
  "median": ["Median", "中位数", "中央値"],
  "memory, now and at most": [
    "Speicher, jetzt und höchstens",
    "内存，当前和峰值",
    "メモリー、現在と最大"
  ],
  "middle of the spots, mm": ["Mitte der Punkte, mm", "光点中心，mm", "スポット中心, mm"],
  "missed": ["verfehlt", "未通过", "不合格"],
  "missing": ["fehlt", "缺失", "なし"],
  "motions": ["Bewegungen", "个动作", "動作"],
  "motions confirmed": ["bestätigte Bewegungen", "已确认的动作", "確認した動作"],
  "motions confirmed until then": [
    "bis dahin bestätigte Bewegungen",
    "此前确认的动作",
    "それまでに確認した動作"
  ],
  "moves": ["bewegt sich", "移动中", "移動中"],
  "moving": ["bewegt sich", "运动中", "動作中"],
  "ms a shot": ["ms je Bild", "毫秒/帧", "ms/ショット"],
  "narrow": ["schmal", "过窄", "細い"],
  "next best": ["nächstbeste", "次优", "次点"],
  "no": ["nein", "否", "いいえ"],
  "no link": ["keine Verbindung", "未连接", "未接続"],
  "no point": ["kein Punkt", "无点", "点なし"],
  "none: matrices": ["keine: Matrizen", "无：矩阵", "なし：行列"],
  "none: scan only": ["keines: nur scannen", "无：仅扫描", "なし：走査のみ"],
  "normal, towards the camera": ["Normale, zur Kamera", "法向（朝相机）", "法線（カメラ向き）"],
  "not set": ["nicht gesetzt", "未设置", "未設定"],
  "not stated": ["nicht angegeben", "未说明", "未指定"],
  "not stated: [tool] in Settings": [
    "nicht angegeben: [tool] in den Einstellungen",
    "未指定：设置中的 [tool]",
    "未指定：設定の [tool]"
  ],
  "not switched here": ["nicht von hier", "不由此控制", "ここでは切替不可"],
  "nothing dropped": ["nichts verworfen", "无丢弃", "破棄なし"],
  "of": ["von", "/", "/"],
  "of the cells measured": ["der Zellen gemessen", "网格已测", "のセルを測定"],
  "working volume above the board": [
    "Messbereich über der Platine",
    "电路板上方的工作范围",
    "基板より上の作業範囲"
  ],
  "working volume below the board": [
    "Messbereich unter der Platine",
    "电路板下方的工作范围",
    "基板より下の作業範囲"
  ],
  "of them saturated": ["davon gesättigt", "其中饱和", "うち飽和"],
  "off": ["aus", "关", "切"],
  "on": ["an", "开", "入"],
  "on the flange": ["am Flansch", "法兰上", "フランジ上"],
  "only in A": ["nur in A", "仅 A", "A のみ"],
  "only in B": ["nur in B", "仅 B", "B のみ"],
  "output": ["Ausgang", "输出", "出力"],
  "outside the working volume": ["außerhalb des Arbeitsraums", "超出工作范围", "作業範囲外"],
  "own": ["eigenes", "自有", "独自"],
  "allowed offset of the part, along the stripe": [
    "zulässiger Versatz des Teils, längs der Linie",
    "零件允许偏移，沿激光线",
    "部品の許容ずれ、線に沿って"
  ],
  "allowed offset of the part, along the sweep": [
    "zulässiger Versatz des Teils, längs der Abtastfahrt",
    "零件允许偏移，沿扫掠方向",
    "部品の許容ずれ、走査方向"
  ],
  "skipped": ["übergangen", "跳过", "飛ばした"],
  "peaks; wanted": ["Spitzen; gewünscht", "峰值；目标", "ピーク；目標"],
  "picture": ["Bild", "图像", "画像"],
  "pictures a second": ["Bilder je Sekunde", "帧/秒", "枚/秒"],
  "pictures without a board": ["Bilder ohne Tafel", "无标定板的图像", "ボードのない画像"],
  "pictures without a count": ["Bilder ohne Zählerstand", "无计数的图像", "カウントのない画像"],
  "pixels": ["Pixel", "像素", "画素"],
  "plane": ["Ebene", "平面", "平面"],
  "pointer": ["Zeiger", "激光指针", "ポインター"],
  "points": ["Punkte", "点", "点"],
  "poor": ["mäßig", "一般", "要注意"],
  "profile hand-eye": [
    "Hand-Auge des Profilsensors",
    "轮廓传感器手眼",
    "プロファイルセンサのハンドアイ"
  ],
  "queued": ["wartet", "排队", "待機"],
  "refused": ["abgelehnt", "拒绝", "却下"],
  "repeats": ["Wiederholungen", "重复次数", "繰り返し"],
  "retract": ["zurückziehen", "退回", "後退"],
  "right": ["rechts", "右", "右"],
  "room light": ["Raumlicht", "室内光", "室内光"],
  "rows": ["Zeilen", "行", "行"],
  "running": ["läuft", "运行中", "実行中"],
  "runs": ["läuft", "运行中", "実行中"],
  "saturated": ["gesättigt", "饱和", "飽和"],
  "scatter, 1 σ": ["Streuung, 1 σ", "离散，1 σ", "ばらつき、1 σ"],
  "score": ["Güte", "得分", "スコア"],
  "section: arrows move the mark, Enter begins and ends a piece": [
    "Schnitt: Pfeile bewegen die Marke, Eingabe beginnt und beendet ein Stück",
    "截面：方向键移动标记，回车开始和结束一段",
    "断面：矢印で印を移動、Enter で区間の開始と終了"
  ],
  "sent": ["gesendet", "已发送", "送信"],
  "shot": ["Bild", "帧", "ショット"],
  "shots": ["Bilder", "帧", "ショット"],
  "shots a second": ["Bilder je Sekunde", "帧/秒", "ショット/秒"],
  "excluded shots": ["Bilder ausgelassen", "已跳过帧", "除外ショット"],
  "shots without a stripe": ["Bilder ohne Streifen", "无条纹帧", "ラインなしショット"],
  "software": ["Software", "软件", "ソフトウェア"],
  "speed": ["Geschwindigkeit", "速度", "速度"],
  "spots off the plane, rms": [
    "Punkte neben der Ebene, rms",
    "光点偏离平面，rms",
    "平面からのずれ, rms"
  ],
  "square to the camera": ["gerade zur Kamera", "正对相机", "カメラに正対"],
  "start": ["Anlauf", "启动", "開始"],
  "stated, 1 σ": ["angegeben, 1 σ", "声明，1 σ", "表示値、1 σ"],
  "steep": ["steil", "过陡", "急"],
  "step": ["Stufe", "台阶", "段差"],
  "stopped": ["angehalten", "已停止", "停止"],
  "stopped; what was done is kept": [
    "angehalten; das Getane bleibt",
    "已停止；已完成部分保留",
    "停止；済んだ分は保存"
  ],
  "stops": ["Halte", "个停点", "停止"],
  "stripe width": ["Streifenbreite", "激光线宽度", "線の幅"],
  "the camera": ["die Kamera", "相机", "カメラ"],
  "the station's limit of speed": [
    "die Geschwindigkeitsgrenze der Station",
    "工作站的速度上限",
    "ステーションの速度上限"
  ],
  "the tool leans": ["Neigung des Werkzeugs", "工具倾斜", "工具の傾き"],
  "tilt": ["Neigung", "倾角", "傾き"],
  "tilt against the base's z": [
    "Neigung gegen z der Basis",
    "相对基座 z 的倾角",
    "ベース z との傾き"
  ],
  "to": ["bis", "至", "上限"],
  "to the confirmed position": ["bis zur bestätigten Position", "至确认位置", "確認した位置まで"],
  "today": ["heute", "今天", "本日"],
  "tool": ["Werkzeug", "工具", "工具"],
  "top": ["oben", "上", "上"],
  "touch": ["tasten", "触测", "接触"],
  "tried": ["versucht", "次尝试", "回試行"],
  "turntable": ["Drehtisch", "转台", "ターンテーブル"],
  "uncertain": ["unsicher", "不确定", "不確か"],
  "usable": ["brauchbar", "可用", "使用可"],
  "waiting for pictures": ["Warten auf Bilder", "等待图像", "画像待ち"],
  "waiting for stages": ["Warten auf Stufen", "等待处理", "処理待ち"],
  "waits": ["wartet", "等待", "待機"],
  "was switched": ["wurde geschaltet", "已切换", "を切り替えました"],
  "what is measured here": ["was hier gemessen wird", "本机测量速度", "ここでの測定速度"],
  "where the boards of the laser plane stood": [
    "wo die Tafeln der Laserebene standen",
    "激光平面标定板所在处",
    "レーザー平面のボードの位置"
  ],
  "wide": ["breit", "过宽", "太い"],
  "widest gap": ["größte Lücke", "最大间隔", "最大の間隔"],
  "windows": ["Fenster", "个窗口", "窓"],
  "with pictures": ["mit Bildern", "包含图像", "画像を含む"],
  "without neighbour": ["ohne Nachbarn", "无邻点", "隣なし"],
  "writing": ["Schreiben", "写入", "書き込み"],
  "yes": ["ja", "是", "はい"],
  "σ": ["σ", "σ", "σ"],
  "σ in the plane": ["σ in der Ebene", "平面内 σ", "面内 σ"],
  "σ of a point, median": ["σ eines Punkts, Median", "点 σ（中位数）", "点の σ（中央値）"],
  "σ of the turn": ["σ der Drehung", "转角 σ", "回転 σ"]
};

// Names of conditions, as reports hold them: English, German, Chinese, Japanese.
export const GATES = {
  "score": ["match score", "Trefferwert", "匹配分数", "一致度"],
  "margin": [
    "lead over the next match",
    "Vorsprung vor dem nächsten Treffer",
    "领先次优匹配",
    "次点との差"
  ],
  "coverage": ["points on the part", "Punkte auf dem Teil", "零件上的点覆盖", "部品上の点の割合"],
  "agreement": [
    "points that fit the part",
    "Punkte, die zum Teil passen",
    "符合零件的点",
    "部品に合う点"
  ],
  "edges seen": ["edges seen", "gesehene Kanten", "可见边缘", "見えた縁"],
  "edges crossed": [
    "edges crossed by the surface",
    "von der Fläche gekreuzte Kanten",
    "被表面跨越的边缘",
    "面が横切る縁"
  ],
  "sigma_mm": ["standard deviation, mm", "Standardabweichung, mm", "标准差，mm", "標準偏差, mm"],
  "sigma_deg": [
    "standard deviation, degrees",
    "Standardabweichung, Grad",
    "标准差，度",
    "標準偏差, 度"
  ],
  "disagreement_mm": [
    "outline against heights, mm",
    "Umriss gegen Höhen, mm",
    "轮廓与高度之差，mm",
    "輪郭と高さの差, mm"
  ],
  "number of looks": [
    "scans of the part",
    "Aufnahmen des Teils",
    "零件扫描次数",
    "部品のスキャン数"
  ],
  "points that tell the turn": [
    "points that decide the turn",
    "Punkte, die die Drehung bestimmen",
    "决定转向的点数",
    "向きを決める点"
  ],
  "turn told": [
    "share for this turn",
    "Anteil für diese Drehung",
    "支持此转向的比例",
    "この向きの割合"
  ],
  "sizes' ratio": [
    "size against the drawing, sigmas",
    "Größe gegen Zeichnung, Sigma",
    "尺寸与图纸之差，σ",
    "図面との寸法差, σ"
  ],
  "range's ratio": [
    "pointer range against the scan, sigmas",
    "Zeigerabstand gegen Scan, Sigma",
    "指示激光距离与扫描之差，σ",
    "距離とスキャンの差, σ"
  ],
  "looks' ratio": [
    "scans against each other, sigmas",
    "Scans untereinander, Sigma",
    "各次扫描之差，σ",
    "スキャン間の差, σ"
  ],
  "looks' misfit": [
    "misfit of the scans, sigmas",
    "Widerspruch der Scans, Sigma",
    "各次扫描的残差，σ",
    "スキャンの残差, σ"
  ],
  "looks' turn_deg": [
    "turn between the scans, degrees",
    "Drehung zwischen den Scans, Grad",
    "扫描间转角，度",
    "スキャン間の回転, 度"
  ],
  "looks' tilt_deg": [
    "tilt between the scans, degrees",
    "Neigung zwischen den Scans, Grad",
    "扫描间倾角，度",
    "スキャン間の傾き, 度"
  ],
  "unseen in plane, mm": [
    "undetected error in the plane, mm",
    "unentdeckter Fehler in der Ebene, mm",
    "平面内未检出误差，mm",
    "面内の検出できない誤差, mm"
  ],
  "unseen height, mm": [
    "undetected error of the height, mm",
    "unentdeckter Höhenfehler, mm",
    "高度未检出误差，mm",
    "高さの検出できない誤差, mm"
  ],
  "unseen turn, deg": [
    "undetected error of the turn, degrees",
    "unentdeckter Drehfehler, Grad",
    "转角未检出误差，度",
    "回転の検出できない誤差, 度"
  ],
  "armed": ["armed", "freigegeben", "已使能", "許可済み"],
  "automatic mode": ["automatic mode", "Automatikbetrieb", "自动模式", "自動モード"],
  "motor on": ["motor on", "Motor ein", "电机开启", "モーター入"],
  "standing still": ["standing still", "steht still", "静止", "停止中"],
  "no emergency stop": ["no emergency stop", "kein Not-Halt", "无急停", "非常停止なし"],
  "the arm's place is known": [
    "the arm's pose is known",
    "die Lage des Arms ist bekannt",
    "机械臂位姿已知",
    "アームの姿勢が既知"
  ],
  "scan of this calibration": [
    "scan made with this calibration",
    "Scan mit dieser Kalibrierung",
    "使用此标定的扫描",
    "この校正によるスキャン"
  ],
  "motions": ["motions", "Bewegungen", "运动数", "動作数"],
  "orthonormality error of the rotation": [
    "error of the rotation matrix",
    "Fehler der Drehmatrix",
    "旋转矩阵误差",
    "回転行列の誤差"
  ],
  "speed, mm/s": ["speed, mm/s", "Geschwindigkeit, mm/s", "速度，mm/s", "速度, mm/s"],
  "slowest speed, mm/s": [
    "slowest speed, mm/s",
    "kleinste Geschwindigkeit, mm/s",
    "最低速度，mm/s",
    "最低速度, mm/s"
  ],
  "turning rate, degrees/s": [
    "turning rate, degrees/s",
    "Drehgeschwindigkeit, Grad/s",
    "转动速度，度/s",
    "回転速度, 度/s"
  ],
  "outside the workspace, mm": [
    "outside the workspace, mm",
    "außerhalb des Arbeitsraums, mm",
    "超出工作空间，mm",
    "作業領域の外, mm"
  ],
  "starts outside the workspace, mm": [
    "starts outside the workspace, mm",
    "beginnt außerhalb des Arbeitsraums, mm",
    "起点超出工作空间，mm",
    "始点が作業領域の外, mm"
  ],
  "way through a keep-out, mm": [
    "path through a keep-out, mm",
    "Weg durch eine Sperrzone, mm",
    "穿过禁区的路径，mm",
    "禁止領域を通る経路, mm"
  ],
  "step, mm": [
    "length of a motion, mm",
    "Länge einer Bewegung, mm",
    "单次移动长度，mm",
    "1動作の長さ, mm"
  ],
  "turn, degrees": [
    "turn of a motion, degrees",
    "Drehung einer Bewegung, Grad",
    "单次转动角度，度",
    "1動作の回転, 度"
  ],
  "errors on the controller": [
    "errors on the controller",
    "Fehler der Steuerung",
    "控制器错误数",
    "コントローラーのエラー"
  ],
  "number of the tool": [
    "tool selected on the controller",
    "gewähltes Werkzeug",
    "控制器所选工具号",
    "選択中のツール番号"
  ],
  "number of the work frame": [
    "work frame selected on the controller",
    "gewähltes Werkstückkoordinatensystem",
    "控制器所选工件坐标系",
    "選択中のワーク座標系"
  ],
  "tilt to the measured normal, degrees": [
    "tilt to the measured normal, degrees",
    "Neigung zur gemessenen Normalen, Grad",
    "与所测法线的夹角，度",
    "測定した法線との傾き, 度"
  ],
  "age of the scan, s": [
    "age of the scan, s",
    "Alter des Scans, s",
    "扫描时间距今，s",
    "スキャンの経過時間, s"
  ]
};
