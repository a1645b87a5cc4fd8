MODULE Sheetlight
  ! Sheetlight from an IRC5 with PC Interface: the arm sweeps the line over a part, sheetlight finds it, the tool goes above it.
  ! Written from the manual; never tried on a real controller. Strings of RAPID have 80 characters: long errors are cut off.
  ! Server: sheetlight robot serve --notation abb --listen 0.0.0.0:5050 ...
  VAR socketdev sl;
  VAR string answer;
  CONST speeddata slow := [50, 30, 30, 30];
  CONST robtarget first := [[300,-25,420],[0,1,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];

  ! Waits for the answer; anything but OK stops the program.
  PROC Heard()
    SocketReceive sl \Str:=answer \Time:=120;
    IF StrPart(answer, 1, 2) <> "OK" THEN
      TPWrite answer;
      SocketClose sl;
      Stop;
    ENDIF
  ENDPROC

  PROC Ask(string words)
    SocketSend sl \Str:=words + "\0A";
    Heard;
  ENDPROC

  ! The k-th number behind OK.
  FUNC num Number(num k)
    VAR num start := 4;
    VAR num stop_ := 0;
    VAR num value := 0;
    VAR bool done;
    FOR n FROM 1 TO k DO
      stop_ := StrFind(answer, start, " \0A");
      IF n = k done := StrToVal(StrPart(answer, start, stop_ - start), value);
      start := stop_ + 1;
    ENDFOR
    RETURN value;
  ENDFUNC

  ! The pose that was asked for, with the configuration of where the arm stands.
  FUNC robtarget Given(string words)
    VAR robtarget t;
    Ask words;
    t := CRobT(\Tool:=tool0 \WObj:=wobj0);
    t.trans := [Number(1), Number(2), Number(3)];
    t.rot := NOrient([Number(4), Number(5), Number(6), Number(7)]);
    RETURN t;
  ENDFUNC

  PROC main()
    VAR robtarget here;
    SocketCreate sl;
    SocketConnect sl, "192.168.0.5", 5050;
    Ask "SCAN";
    SetDO line_laser, 1;
    FOR i FROM 0 TO 99 DO
      MoveL Offs(first, 0, 0.5 * i, 0), slow, fine, tool0 \WObj:=wobj0;
      WaitTime \InPos, 0.1;
      here := CRobT(\Tool:=tool0 \WObj:=wobj0);
      SocketSend sl \Str:="POSE " + ValToStr(here.trans) + ",";
      SocketSend sl \Str:=ValToStr(here.rot) + "\0A";
      Heard;
    ENDFOR
    SetDO line_laser, 0;
    Ask "FIND led";
    MoveL Given("GIVE approach flange"), slow, fine, tool0 \WObj:=wobj0;
    Stop; ! is the tool above the part?
    MoveL Given("GIVE insertion flange"), slow, fine, tool0 \WObj:=wobj0;
    ! open the gripper here
    MoveL Given("GIVE retract flange"), slow, fine, tool0 \WObj:=wobj0;
    Ask "BYE";
    SocketClose sl;
  ENDPROC
ENDMODULE
